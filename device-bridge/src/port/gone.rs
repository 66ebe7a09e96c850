//! What stands in a port whose device was taken out of it.

use std::time::Duration;

use nalgebra::Vector6;

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample};

pub(super) struct Gone(DeviceInfo);

impl Gone {
    /// In the place of a device of this name.
    pub(super) fn instead_of(device: &DeviceInfo) -> Box<dyn Device> {
        Box::new(Self(device.clone()))
    }
}

impl Device for Gone {
    fn info(&self) -> &DeviceInfo {
        &self.0
    }

    fn read(&mut self, _now: Duration) -> Result<DeviceSample, DeviceFault> {
        Err(DeviceFault::Ended)
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6<f64>) {}
}
