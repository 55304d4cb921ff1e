//! Starting a device, and its control while it runs.

use super::control::{Control, answer_broadcasts};
use super::facts::{DeviceCounts, SentFrame};
use super::pictures::Pictures;
use super::sender::Sender;
use super::sensor::Sensor;
use super::settings::{DeviceSettings, TriggerOf};
use super::shared::{LOOK, Shared};
use super::words::locked;
use crate::pixel_format::PixelFormat;
use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread::{Builder, JoinHandle};
use telegenic::gige::proto::gvcp::GVCP_PORT;
use trueline_live::HostClock;

/// Addresses of a question to all cameras. Only one device of a machine gets them.
const BROADCASTS: [Ipv4Addr; 2] = [Ipv4Addr::BROADCAST, Ipv4Addr::new(127, 255, 255, 255)];

/// A simulated camera.
pub struct Device;

impl Device {
    /// Switches one on. Times in its facts, and those of its exposures, are on the steady clock of `host`.
    ///
    /// # Errors
    /// Error of the operating system, above all that the address is taken or not of this machine.
    pub fn start(
        settings: DeviceSettings,
        host: HostClock,
        pictures: impl Pictures + 'static,
    ) -> io::Result<DeviceHandle> {
        let address = settings.address;
        let socket = UdpSocket::bind((address, GVCP_PORT))?;
        let stream = UdpSocket::bind((address, 0))?;
        let shared = Arc::new(Shared::new(settings, host));
        locked(&shared.registers).set_stream_port(stream.local_addr()?.port());
        // Stops the started parts if the rest cannot start.
        let mut handle = DeviceHandle { shared: Arc::clone(&shared), threads: Vec::new() };
        for broadcast in BROADCASTS {
            let Ok(heard) = UdpSocket::bind((broadcast, GVCP_PORT)) else { continue };
            heard.set_read_timeout(Some(LOOK))?;
            let (shared, answer) = (Arc::clone(&shared), socket.try_clone()?);
            handle.spawn("camera-discovery", move || answer_broadcasts(&shared, &heard, &answer))?;
        }
        let control = Control::new(Arc::clone(&shared), socket, stream.try_clone()?)?;
        handle.spawn("camera-control", move || control.run())?;
        let (out, ready) = channel();
        let sender = Sender::new(Arc::clone(&shared), stream);
        handle.spawn("camera-stream", move || sender.run(&ready))?;
        let sensor = Sensor::new(shared, Box::new(pictures), out);
        handle.spawn("camera-sensor", move || sensor.run())?;
        Ok(handle)
    }
}

/// A device that runs until it is stopped or dropped.
pub struct DeviceHandle {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl DeviceHandle {
    fn spawn(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        self.threads.push(Builder::new().name(name.to_owned()).spawn(work)?);
        Ok(())
    }

    /// Switches it off; done when all of its threads have ended.
    pub fn stop(mut self) {
        self.end();
    }

    fn end(&mut self) {
        self.shared.stop();
        for thread in self.threads.drain(..) {
            // One that panicked has told so itself.
            let _ = thread.join();
        }
    }

    /// Its counts so far.
    #[must_use]
    pub fn counts(&self) -> DeviceCounts {
        self.shared.counts()
    }

    /// The last 4096 pictures sent, oldest first.
    #[must_use]
    pub fn sent(&self) -> Vec<SentFrame> {
        self.shared.sent()
    }

    /// Its clock's reading at a steady time, ns both.
    #[must_use]
    pub fn device_ns(&self, steady_ns: i64) -> i64 {
        self.shared.clock.device_ns(steady_ns)
    }

    /// Pulls the cable: nothing comes or goes any more.
    pub fn unplug(&self) {
        self.shared.unplug();
    }

    /// Sets its clock by this amount from now on, ns.
    pub fn step_clock(&self, by_ns: i64) {
        self.shared.clock.step(self.shared.now_ns(), by_ns);
    }

    /// Turns automatic exposure on or off, as another program or the camera itself may.
    pub fn set_exposure_auto(&self, on: bool) {
        locked(&self.shared.registers).set_exposure_auto(on);
    }

    /// Turns automatic gain on or off.
    pub fn set_gain_auto(&self, on: bool) {
        locked(&self.shared.registers).set_gain_auto(on);
    }

    /// Changes the size of the pictures, px.
    pub fn set_size(&self, width: u32, height: u32) {
        locked(&self.shared.registers).set_size(width, height);
    }

    /// Changes the pixel format.
    pub fn set_pixel_format(&self, format: PixelFormat) {
        locked(&self.shared.registers).set_format(format);
    }

    /// Turns a trigger on or off, by the input `Line1`.
    pub fn set_trigger(&self, of: TriggerOf, on: bool) {
        locked(&self.shared.registers).set_trigger(of, on);
    }

    /// Switches the precision time protocol on or off, and sets whether it follows a clock. The clock itself does not
    /// change.
    pub fn set_ptp(&self, on: bool, slave: bool) {
        locked(&self.shared.registers).set_ptp(on, slave);
    }
}

impl Drop for DeviceHandle {
    fn drop(&mut self) {
        self.end();
    }
}
