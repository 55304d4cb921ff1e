"""Publishes poses as a robot's ROS 2 driver does, by Eclipse Cyclone DDS: ros2_driver.py SECONDS TOPIC [KIND].

KIND `tf`: transforms on TOPIC and TOPIC_static in place of poses; `loop`, `missing`, `changed`: the same with that fault."""

import math
import sys
import time

from ros2_domain import Domain, Header, Point, Pose, PoseStamped, Quaternion, TFMessage, Transform, TransformStamped, Vector3, stamp


def pose(k):
    angle = 0.2 * math.sin(0.01 * k)
    turned = Quaternion(math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2))
    return Pose(Point(0.5 + 1e-4 * k, -0.25, 0.75), turned)


def transform(stamped, parent, child, x, y, z):
    still = Quaternion(0.0, 0.0, 0.0, 1.0)
    return TransformStamped(Header(stamped, parent), child, Transform(Vector3(x, y, z), still))


def transforms(seconds, topic, fault):
    """base -> rail -> wrist moves, wrist -> tool0 is static and published once, before anybody listens."""
    domain = Domain()
    statics = domain.writer(f"{topic}_static", TFMessage, kept=True)
    writer = domain.writer(topic, TFMessage)
    if fault != "missing":
        statics.write(TFMessage([transform(stamp(time.time_ns()), "wrist", "tool0", 0.0, 0.0, 0.125)]))
    begun = time.time()
    k = 0
    while time.time() - begun < seconds:
        now = stamp(time.time_ns())
        told = [transform(now, "rail", "wrist", 0.0, 0.25, 0.5), transform(now, "base", "rail", 0.5 + 1e-4 * k, 0.0, 0.0)]
        if fault == "loop":
            told.append(transform(now, "wrist", "base", 1.0, 0.0, 0.0))
        writer.write(TFMessage(told))
        if fault == "changed" and k == 800:
            statics.write(TFMessage([transform(stamp(time.time_ns()), "wrist", "tool0", 0.0, 0.0, 0.126)]))
        k += 1
        time.sleep(max(0.0, begun + 0.01 * k - time.time()))
    print(k)


def main(seconds, topic):
    writer = Domain().writer(topic, PoseStamped)
    begun = time.time()
    k = 0
    while time.time() - begun < seconds:
        writer.write(PoseStamped(Header(stamp(time.time_ns()), "base_link"), pose(k)))
        k += 1
        time.sleep(max(0.0, begun + 0.01 * k - time.time()))
    print(k)


if __name__ == "__main__":
    if len(sys.argv) > 3:
        transforms(float(sys.argv[1]), sys.argv[2], sys.argv[3])
    else:
        main(float(sys.argv[1]), sys.argv[2])
