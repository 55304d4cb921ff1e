"""The other side of trueline's robot streams, played by packages that were not written here.

    robots_peer.py WHAT [ARGUMENT ...]     prints one JSON object; exit code 0 if the package was content

Position and attitude of the simulated robots are the start of `stream-sim`'s small S: x 700, y 0, z 600 mm, tool downwards.
"""
import json
import math
import sys
import time

START_MM = [700.0, 0.0, 600.0]


def near(found, wanted, tolerance):
    return all(abs(a - b) <= tolerance for a, b in zip(found, wanted))


def ur_rtde(host):
    """SDU's client reads our server (port 30004)."""
    import rtde_receive
    client = rtde_receive.RTDEReceiveInterface(host, 500.0)
    poses, stamps = [], []
    for _ in range(100):
        poses.append(client.getActualTCPPose())
        stamps.append(client.getTimestamp())
        time.sleep(0.01)
    mm = [1e3 * v for v in poses[0][:3]]
    turn = math.sqrt(sum(v * v for v in poses[0][3:]))
    good = near(mm, START_MM, 1e-6) and abs(turn - math.pi) < 1e-6
    good = good and 0.7 < stamps[-1] - stamps[0] < 1.5 and client.isConnected()
    client.disconnect()
    return good, {"position_mm": mm, "turn_rad": turn, "stamps_s": [stamps[0], stamps[-1]]}


def ur_own(host, library):
    """The maker's own client reads our server; LIBRARY is its folder."""
    sys.path.insert(0, library)
    import rtde.rtde as rtde
    client = rtde.RTDE(host, 30004)
    client.connect()
    version = client.get_controller_version()
    names, kinds = ["timestamp", "actual_TCP_pose", "robot_mode"], ["DOUBLE", "VECTOR6D", "INT32"]
    good = client.send_output_setup(names, kinds, frequency=500) and client.send_start()
    states = []
    until = time.monotonic() + 1.0
    while time.monotonic() < until:
        state = client.receive()
        if state is not None:
            states.append((state.timestamp, list(state.actual_TCP_pose), state.robot_mode))
    good = good and client.send_pause()
    client.disconnect()
    good = good and len(states) > 200 and all(mode == 7 for _, _, mode in states)
    good = good and near([1e3 * v for v in states[0][1][:3]], START_MM, 1e-6)
    return good, {"version": version, "states": len(states), "first": states[:1]}


def hspo(address):
    """fanuc-ucl's receiver hears our HSPO; it must run before the robot speaks."""
    from fanuc_ucl import hspo as package
    package.initialize_broker(address)
    receiver = package.HspoReceiver(address.split(":")[0], 128, 0.5)
    found = []
    until = time.monotonic() + 3.0
    while time.monotonic() < until:
        found.extend(receiver.tcp.recv_all())
        time.sleep(0.05)
    first = found[0] if found else None
    fields = {name: getattr(first, name) for name in dir(first) if not name.startswith("_")} if first else {}
    fields = {name: value for name, value in fields.items() if isinstance(value, (int, float))}
    good = len(found) > 200 and near([fields.get(k, 0.0) for k in "xyz"], START_MM, 1e-3)
    return good, {"packets": len(found), "first": fields}


def crx_emulator(version, seconds):
    """airo-fanuc's strict controller emulator; our listener calls its port (printed first)."""
    from airo_fanuc.testing import FakeCRXConfig, FakeCRXController
    controller = FakeCRXController(FakeCRXConfig(available_version=int(version)))
    controller.start()
    controller.set_cartesian([500, 10, 400, 180, 0, 30])
    controller.start_realtime()
    print(controller.sm_port, flush=True)
    time.sleep(float(seconds))
    violations = [str(v) for v in controller.violations]
    controller.close()
    return not violations, {"violations": violations}


def crx_client(host, port):
    """airo-fanuc's compiled client listens to our Stream Motion controller."""
    from airo_fanuc import _core
    client = _core.StreamCore(host, int(port))
    client.start()
    client.wait_ready(2)
    time.sleep(0.5)
    snapshot = client.get_snapshot()
    cart = list(snapshot["cart"])[:6]
    client.stop()
    return near(cart[:3], START_MM, 1e-3) and abs(abs(cart[3]) - 180) < 1e-3, {"cart": cart}


def stmo_client(host):
    """fanuc-ucl's Stream Motion client (versions 1 and 2) reads our controller on port 60015."""
    from fanuc_ucl import stmo
    client = stmo.StreamMotionDriver(host, 10)
    client.connect()
    client.start(2.0)
    time.sleep(0.5)
    states = client.pull_states()
    pose = states[-1].pose if states else None
    found = [pose.x, pose.y, pose.z] if pose else []
    client.disconnect()
    return len(states) > 20 and near(found, START_MM, 1e-3), {"states": len(states), "position_mm": found}


def rsi_server(port, seconds, configuration=None):
    """rsipi's controller sends to our listener on 127.0.0.1:PORT, by its own ONLYSEND context or by one that we wrote."""
    import os
    import pathlib
    import re
    import socket
    import tempfile
    written = pathlib.Path(configuration).read_text() if configuration else None
    # The package writes its log where it runs.
    os.chdir(tempfile.mkdtemp())
    import RSIPI.rsi_echo_server as package
    source = pathlib.Path(package.__file__).parent / "contexts" / "RSI_EthernetConfig_OnlySend.xml"
    text = written or re.sub(r"<PORT>.*?</PORT>", f"<PORT>{port}</PORT>", source.read_text())
    text = re.sub(r"<IP_NUMBER>.*?</IP_NUMBER>", "<IP_NUMBER>127.0.0.1</IP_NUMBER>", text)
    pathlib.Path("config.xml").write_text(text)
    bind = socket.socket.bind
    # The package listens on every address; a test does not.
    socket.socket.bind = lambda self, address: bind(self, ("127.0.0.1", 0 if address[1] == 50000 else address[1]))
    server = package.EchoServer("config.xml", delay_ms=4)
    server.start()
    time.sleep(float(seconds))
    server.stop()
    return True, {"context": "ours" if written else source.name}


def rsi_answered(port, seconds, config):
    """rsipi's controller with its own context that waits for answers, RKorr among them; written to CONFIG for our side."""
    import os
    import pathlib
    import re
    import socket
    import tempfile
    os.chdir(tempfile.mkdtemp())
    import RSIPI.rsi_echo_server as package
    source = pathlib.Path(package.__file__).parent / "contexts" / "RSI_EthernetConfig_Full.xml"
    text = re.sub(r"<PORT>.*?</PORT>", f"<PORT>{port}</PORT>", source.read_text())
    text = re.sub(r"<IP_NUMBER>.*?</IP_NUMBER>", "<IP_NUMBER>127.0.0.1</IP_NUMBER>", text)
    pathlib.Path(config).write_text(text)
    bind = socket.socket.bind
    socket.socket.bind = lambda self, address: bind(self, ("127.0.0.1", 0 if address[1] == 50000 else address[1]))
    server = package.EchoServer(config, delay_ms=12)
    taken = []
    process = server.process_reply
    server.process_reply = lambda text: taken.append(process(text)) or taken[-1]
    time.sleep(2.5)
    position = lambda: [float(server.state["RIst"][axis]) for axis in "XYZABC"]
    began = position()
    server.start()
    time.sleep(float(seconds))
    good = server.running and taken.count(True) > 50 and taken.count(False) == 0 and server.faulty_packets < 20
    told = {"accepted": taken.count(True), "refused": taken.count(False), "late": taken.count(None),
            "faulty": server.faulty_packets, "moved": position() != began}
    server.stop()
    return good and not told["moved"], told


def kroshu(folder, port, seconds):
    """kroshu's simulator (kuka_rsi_simulator of kuka_drivers), with a stand-in for the few parts of ROS that it uses."""
    import types
    quiet = types.SimpleNamespace(info=lambda *_: None, warn=lambda *_: None, error=lambda *_: None)

    class Node:
        values = {"rsi_port": int(port)}

        def __init__(self, name):
            pass

        def create_timer(self, period, call):
            self.period, self.call = period, call

        def declare_parameter(self, name, value):
            self.values.setdefault(name, value)

        def get_parameter(self, name):
            value = self.values[name]
            told = types.SimpleNamespace(string_value=value, integer_value=value, bool_value=value)
            return types.SimpleNamespace(get_parameter_value=lambda: told)

        def create_publisher(self, *_):
            return types.SimpleNamespace(publish=lambda _: None)

        def get_logger(self):
            return quiet

    modules = {name: types.ModuleType(name) for name in
               ["rclpy", "rclpy.node", "std_msgs", "std_msgs.msg", "yaml", "ament_index_python"]}
    modules["rclpy.node"].Node = Node
    modules["std_msgs.msg"].String = lambda data: data
    for name, module in modules.items():
        sys.modules.setdefault(name, module)
    sys.path.insert(0, folder)
    from kuka_rsi_simulator.rsi_simulator import RSISimulator
    node = RSISimulator("rsi_simulator_node")
    at_first = node.act_joint_pos.copy()
    time.sleep(2.5)
    until = time.time() + float(seconds)
    while time.time() < until:
        before = time.time()
        node.call()
        time.sleep(max(0.0, node.period - (time.time() - before)))
    told = {"answered": node.ipoc, "timeouts": node.timeout_count, "moved": bool((node.act_joint_pos != at_first).any())}
    return node.ipoc > 50 and node.timeout_count < 10 and not told["moved"], told


PEERS = {
    "ur-rtde": ur_rtde,
    "ur-own": ur_own,
    "fanuc-ucl-hspo": hspo,
    "airo-fanuc-emulator": crx_emulator,
    "airo-fanuc-client": crx_client,
    "fanuc-ucl-stmo": stmo_client,
    "rsipi-server": rsi_server,
    "rsipi-answered": rsi_answered,
    "kroshu": kroshu,
}

if __name__ == "__main__":
    good, told = PEERS[sys.argv[1]](*sys.argv[2:])
    print(json.dumps({"good": bool(good), **told}, default=str), flush=True)
    sys.exit(0 if good else 1)
