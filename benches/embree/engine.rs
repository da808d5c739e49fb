//! Embree's device and scenes.

#![allow(unsafe_code)]

use std::ffi::{CString, c_int, c_uint, c_void};
use std::sync::atomic::{AtomicIsize, Ordering};
use std::time::Duration;

use octray::workload::{Model, Part};

use crate::api::{self, Api, Handle};
use crate::clock::Clock;

/// Embree's qualities of tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quality {
    Low = api::QUALITY_LOW as isize,
    Medium = api::QUALITY_MEDIUM as isize,
    High = api::QUALITY_HIGH as isize,
}

impl Quality {
    pub(crate) const ALL: [Self; 3] = [Self::Low, Self::Medium, Self::High];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }
}

/// How a scene is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BuildMode {
    pub(crate) robust: bool,
    pub(crate) quality: Quality,
}

impl BuildMode {
    pub(crate) const ALL: [Self; 4] = [
        Self { robust: false, quality: Quality::Medium },
        Self { robust: false, quality: Quality::High },
        Self { robust: true, quality: Quality::Medium },
        Self { robust: true, quality: Quality::High },
    ];

    pub(crate) fn name(self) -> &'static str {
        match (self.robust, self.quality) {
            (false, Quality::Low) => "fast low",
            (false, Quality::Medium) => "fast medium",
            (false, Quality::High) => "fast high",
            (true, Quality::Low) => "robust low",
            (true, Quality::Medium) => "robust medium",
            (true, Quality::High) => "robust high",
        }
    }
}

/// Embree, ready to build.
pub(crate) struct Device {
    pub(crate) api: Api,
    handle: Handle,
    bytes: Box<AtomicIsize>,
}

/// Counts memory. `bytes` is the device's counter.
unsafe extern "C" fn monitor(bytes: *mut c_void, more: isize, _: bool) -> bool {
    // SAFETY: the device's counter outlives the device.
    let bytes = unsafe { &*bytes.cast::<AtomicIsize>() };
    bytes.fetch_add(more, Ordering::Relaxed);
    true
}

// SAFETY: Embree's devices may be used by several threads.
unsafe impl Sync for Device {}

impl Device {
    /// A device that builds on so many threads; 0 for all.
    pub(crate) fn new(api: Api, threads: usize) -> Result<Self, String> {
        let configuration = CString::new(format!("threads={threads}")).expect("no zero in it");
        // SAFETY: the string lives through the call.
        let handle = unsafe { (api.new_device)(configuration.as_ptr()) };
        if handle.is_null() {
            return Err("Embree makes no device here".into());
        }
        let bytes = Box::<AtomicIsize>::default();
        // SAFETY: the box is dropped after the device is released.
        unsafe { (api.memory_monitor)(handle, monitor, (&raw const *bytes).cast_mut().cast()) };
        Ok(Self { api, handle, bytes })
    }

    /// How much memory Embree has for this device's scenes.
    fn bytes(&self) -> isize {
        self.bytes.load(Ordering::Relaxed)
    }

    fn property(&self, property: c_int) -> isize {
        // SAFETY: the device is alive.
        unsafe { (self.api.device_property)(self.handle, property) }
    }

    /// Such as `4.4.0`.
    pub(crate) fn version(&self) -> String {
        let number = self.property(api::PROPERTY_VERSION);
        format!("{}.{}.{}", number / 10000, number / 100 % 100, number % 100)
    }

    /// The widest packets that Embree has kernels for on this CPU.
    pub(crate) fn native_width(&self) -> usize {
        if self.property(api::PROPERTY_RAY16) != 0 {
            16
        } else if self.property(api::PROPERTY_RAY8) != 0 {
            8
        } else {
            1
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: scenes borrow the device, so none is left.
        unsafe { (self.api.release_device)(self.handle) }
    }
}

/// A built scene; geometries have the numbers of the model's parts.
pub(crate) struct EmbreeScene<'a> {
    pub(crate) device: &'a Device,
    pub(crate) handle: Handle,
    pub(crate) mode: BuildMode,
    pub(crate) build_time: Duration,
    /// What the build took and kept, beside the geometry's buffers.
    pub(crate) tree_bytes: isize,
}

// SAFETY: a committed scene may be traced by several threads.
unsafe impl Sync for EmbreeScene<'_> {}

impl<'a> EmbreeScene<'a> {
    pub(crate) fn build(
        device: &'a Device,
        model: &Model,
        mode: BuildMode,
        clock: Clock,
    ) -> Result<Self, String> {
        let api = &device.api;
        let quality = mode.quality as c_int;
        // SAFETY: the handles are those that Embree just made, in the order of its documentation.
        let (handle, build_time, tree_bytes) = unsafe {
            let scene = (api.new_scene)(device.handle);
            (api.scene_flags)(scene, if mode.robust { api::SCENE_ROBUST } else { 0 });
            (api.scene_quality)(scene, quality);
            for (id, part) in model.parts.iter().enumerate() {
                let geometry = device.geometry(part);
                (api.geometry_quality)(geometry, quality);
                (api.commit_geometry)(geometry);
                (api.attach)(scene, geometry, id as c_uint);
                (api.release_geometry)(geometry);
            }
            let bytes = device.bytes();
            let running = clock.start();
            (api.commit_scene)(scene);
            (scene, Duration::from_secs_f64(running.seconds()), device.bytes() - bytes)
        };
        let scene = Self { device, handle, mode, build_time, tree_bytes };
        // SAFETY: the device is alive.
        match unsafe { (api.device_error)(device.handle) } {
            0 => Ok(scene),
            code => Err(format!("Embree's build failed with error {code}")),
        }
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene is alive and nobody else has it.
        unsafe { (self.device.api.release_scene)(self.handle) }
    }
}

impl Device {
    /// A geometry with buffers of its own, not committed yet.
    fn geometry(&self, part: &Part) -> Handle {
        match part {
            Part::Mesh(mesh) => {
                let geometry = self.new_geometry(api::GEOMETRY_TRIANGLE);
                let positions = mesh.positions.iter().map(|position| position.to_array());
                self.fill(geometry, api::BUFFER_VERTEX, api::FORMAT_FLOAT3, positions);
                let indices = mesh.indices.iter().copied();
                self.fill(geometry, api::BUFFER_INDEX, api::FORMAT_UINT3, indices);
                geometry
            }
            Part::Quads(quads) => {
                let geometry = self.new_geometry(api::GEOMETRY_QUAD);
                let corners: Vec<[f32; 3]> = (0..quads.len())
                    .flat_map(|index| quads.corners(index).map(|corner| corner.to_array()))
                    .collect();
                self.fill(geometry, api::BUFFER_VERTEX, api::FORMAT_FLOAT3, corners.into_iter());
                let count = quads.len() as u32;
                let indices = (0..count).map(|quad| [0, 1, 2, 3].map(|corner| 4 * quad + corner));
                self.fill(geometry, api::BUFFER_INDEX, api::FORMAT_UINT4, indices);
                geometry
            }
            Part::Spheres(spheres) => {
                let geometry = self.new_geometry(api::GEOMETRY_SPHERE_POINT);
                let points = (0..spheres.len())
                    .map(|index| spheres.center(index).extend(spheres.radius[index]).to_array());
                self.fill(geometry, api::BUFFER_VERTEX, api::FORMAT_FLOAT4, points);
                geometry
            }
        }
    }

    fn new_geometry(&self, kind: c_int) -> Handle {
        // SAFETY: the device is alive.
        unsafe { (self.api.new_geometry)(self.handle, kind) }
    }

    fn fill<T: Copy>(
        &self,
        geometry: Handle,
        buffer: c_int,
        format: c_int,
        items: impl ExactSizeIterator<Item = T>,
    ) {
        let count = items.len();
        // SAFETY: Embree gives room for `count` items of this size, aligned for them and padded.
        unsafe {
            let room = (self.api.new_buffer)(geometry, buffer, 0, format, size_of::<T>(), count)
                .cast::<T>();
            assert!(!room.is_null() || count == 0, "Embree has no room for {count} items");
            items.enumerate().for_each(|(index, item)| room.add(index).write(item));
        }
    }
}
