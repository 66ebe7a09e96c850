//! How long the graphics card itself takes for each pass.

use std::sync::{Mutex, PoisonError};

use super::gpu::Gpu;
use super::resources::buffer;
use crate::error::RenderError;

/// Passes of a frame that are timed; those beyond are not.
const MOST_PASSES: u32 = 64;

const BYTES: u64 = 2 * MOST_PASSES as u64 * size_of::<u64>() as u64;

/// The card's clock, read when a pass begins and when it ends.
#[derive(Debug)]
pub(crate) struct PassTimes {
    clock: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
    names: Mutex<Vec<&'static str>>,
}

impl PassTimes {
    /// `None` where the adapter has no such clock.
    pub(crate) fn new(device: &wgpu::Device) -> Option<Self> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |label, usage| buffer(device, label, BYTES, usage);
        let resolving = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        Some(Self {
            clock: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_PASSES,
            }),
            resolved: buffer("pass times", resolving),
            readback: buffer("pass times read back", wgpu::BufferUsages::MAP_READ),
            names: Mutex::default(),
        })
    }

    /// For the descriptor of a pass that begins.
    pub(crate) fn of(&self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let mut names = self.names.lock().unwrap_or_else(PoisonError::into_inner);
        let place = names.len() as u32;
        (place < MOST_PASSES).then(|| {
            names.push(name);
            wgpu::RenderPassTimestampWrites {
                query_set: &self.clock,
                beginning_of_pass_write_index: Some(2 * place),
                end_of_pass_write_index: Some(2 * place + 1),
            }
        })
    }

    /// Waits for all passes since the last call; their names and milliseconds, in their order.
    pub(crate) fn take(&self, gpu: &Gpu) -> Result<Vec<(&'static str, f64)>, RenderError> {
        let names = std::mem::take(&mut *self.names.lock().unwrap_or_else(PoisonError::into_inner));
        if names.is_empty() {
            return Ok(Vec::new());
        }
        let count = 2 * names.len() as u32;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.resolve_query_set(&self.clock, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readback, 0, BYTES);
        gpu.queue.submit([encoder.finish()]);
        let ticks: Vec<u64> = {
            let mapped = gpu.read(&self.readback)?;
            bytemuck::pod_collect_to_vec(&mapped)
        };
        self.readback.unmap();
        let ms = 1e-6 * f64::from(gpu.queue.get_timestamp_period());
        let times = ticks.chunks_exact(2).map(|of| match of {
            [begun, ended] => ms * ended.saturating_sub(*begun) as f64,
            _ => 0.0,
        });
        Ok(names.into_iter().zip(times).collect())
    }
}
