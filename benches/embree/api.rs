//! Embree 4's C interface: own declarations of the few structs and functions that are needed.
//!
//! Layouts follow the public headers `rtcore_ray.h`, `rtcore_scene.h` and `rtcore_geometry.h` of
//! version 4.0 and later. Where a struct may have a field more or less at its end, depending on how
//! Embree was built, it is declared with the field.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uint, c_void};

/// An opaque Embree object: device, scene or geometry.
pub(crate) type Handle = *mut c_void;

pub(crate) const INVALID_ID: u32 = u32::MAX;

pub(crate) const GEOMETRY_TRIANGLE: c_int = 0;
pub(crate) const GEOMETRY_QUAD: c_int = 1;
pub(crate) const GEOMETRY_SPHERE_POINT: c_int = 50;

pub(crate) const BUFFER_INDEX: c_int = 0;
pub(crate) const BUFFER_VERTEX: c_int = 1;

pub(crate) const FORMAT_UINT3: c_int = 0x5003;
pub(crate) const FORMAT_UINT4: c_int = 0x5004;
pub(crate) const FORMAT_FLOAT3: c_int = 0x9003;
pub(crate) const FORMAT_FLOAT4: c_int = 0x9004;

pub(crate) const QUALITY_LOW: c_int = 0;
pub(crate) const QUALITY_MEDIUM: c_int = 1;
pub(crate) const QUALITY_HIGH: c_int = 2;

pub(crate) const SCENE_ROBUST: c_int = 1 << 2;

pub(crate) const QUERY_INCOHERENT: c_int = 0;
pub(crate) const QUERY_COHERENT: c_int = 1 << 16;

/// Triangles, quads and sphere points: nothing else is in our scenes.
pub(crate) const FEATURES: c_int = 1 << 1 | 1 << 2 | 1 << 20;

pub(crate) const PROPERTY_VERSION: c_int = 0;
pub(crate) const PROPERTY_RAY8: c_int = 33;
pub(crate) const PROPERTY_RAY16: c_int = 34;

/// Gives a packet its alignment without taking room.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub(crate) struct Align16;
/// See [`Align16`].
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Align32;
/// See [`Align16`].
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Align64;

/// `RTCRay`, `RTCRay8`, `RTCRay16`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct RayPacket<A, const N: usize> {
    align: [A; 0],
    pub(crate) origin_x: [f32; N],
    pub(crate) origin_y: [f32; N],
    pub(crate) origin_z: [f32; N],
    pub(crate) t_near: [f32; N],
    pub(crate) dir_x: [f32; N],
    pub(crate) dir_y: [f32; N],
    pub(crate) dir_z: [f32; N],
    time: [f32; N],
    pub(crate) t_far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
}

/// `RTCRayHit`, `RTCRayHit8`, `RTCRayHit16`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct RayHitPacket<A, const N: usize> {
    pub(crate) ray: RayPacket<A, N>,
    normal: [[f32; N]; 3],
    pub(crate) u: [f32; N],
    pub(crate) v: [f32; N],
    pub(crate) prim_id: [u32; N],
    pub(crate) geom_id: [u32; N],
    instance: [[u32; N]; 2],
}

const _: () = {
    assert!(size_of::<RayPacket<Align16, 1>>() == 48);
    assert!(size_of::<RayPacket<Align32, 8>>() == 48 * 8);
    assert!(size_of::<RayPacket<Align64, 16>>() == 48 * 16);
    assert!(std::mem::offset_of!(RayHitPacket<Align16, 1>, geom_id) == 18 * 4);
    assert!(std::mem::offset_of!(RayHitPacket<Align64, 16>, geom_id) == 18 * 64);
};

impl<A, const N: usize> RayPacket<A, N> {
    /// Rays at the origin without direction; the mask lets them hit everything.
    pub(crate) fn new() -> Self {
        let (zeros, ids) = ([0.0; N], [0; N]);
        Self {
            align: [],
            origin_x: zeros,
            origin_y: zeros,
            origin_z: zeros,
            t_near: zeros,
            dir_x: zeros,
            dir_y: zeros,
            dir_z: zeros,
            time: zeros,
            t_far: zeros,
            mask: [u32::MAX; N],
            id: ids,
            flags: ids,
        }
    }
}

impl<A, const N: usize> RayHitPacket<A, N> {
    /// Such rays, each with a miss.
    pub(crate) fn new() -> Self {
        let (zeros, ids) = ([0.0; N], [INVALID_ID; N]);
        Self {
            ray: RayPacket::new(),
            normal: [zeros; 3],
            u: zeros,
            v: zeros,
            prim_id: ids,
            geom_id: ids,
            instance: [ids; 2],
        }
    }
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`, which have the same fields.
#[repr(C)]
pub(crate) struct Arguments {
    pub(crate) flags: c_int,
    pub(crate) features: c_int,
    context: *mut c_void,
    filter: *const c_void,
    callback: *const c_void,
    min_width_factor: f32,
}

impl Arguments {
    pub(crate) fn new(flags: c_int) -> Self {
        Self {
            flags,
            features: FEATURES,
            context: std::ptr::null_mut(),
            filter: std::ptr::null(),
            callback: std::ptr::null(),
            min_width_factor: 0.0,
        }
    }
}

/// Is told how many bytes come or, as a negative number, go; must answer true.
pub(crate) type MemoryMonitor = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

pub(crate) type Single<T> = unsafe extern "C" fn(Handle, *mut T, *mut Arguments);
pub(crate) type Wide<T> = unsafe extern "C" fn(*const c_int, Handle, *mut T, *mut Arguments);

macro_rules! functions {
    ($($name:ident = $symbol:literal: $type:ty,)*) => {
        /// The functions of a loaded library.
        pub(crate) struct Api {
            $(pub(crate) $name: $type,)*
            // Dropped last: the pointers lead into it.
            _library: libloading::Library,
        }

        impl Api {
            /// Looks the functions up.
            ///
            /// # Safety
            /// The library must be Embree 4.
            pub(crate) unsafe fn new(
                library: libloading::Library,
            ) -> Result<Self, libloading::Error> {
                Ok(Self {
                    // SAFETY: the caller says that this is Embree 4; the types are those of its
                    // headers.
                    $($name: unsafe { *library.get::<$type>($symbol)? },)*
                    _library: library,
                })
            }
        }
    };
}

functions! {
    new_device = b"rtcNewDevice\0": unsafe extern "C" fn(*const c_char) -> Handle,
    release_device = b"rtcReleaseDevice\0": unsafe extern "C" fn(Handle),
    device_property = b"rtcGetDeviceProperty\0": unsafe extern "C" fn(Handle, c_int) -> isize,
    device_error = b"rtcGetDeviceError\0": unsafe extern "C" fn(Handle) -> c_int,
    memory_monitor = b"rtcSetDeviceMemoryMonitorFunction\0":
        unsafe extern "C" fn(Handle, MemoryMonitor, *mut c_void),
    new_geometry = b"rtcNewGeometry\0": unsafe extern "C" fn(Handle, c_int) -> Handle,
    geometry_quality = b"rtcSetGeometryBuildQuality\0": unsafe extern "C" fn(Handle, c_int),
    new_buffer = b"rtcSetNewGeometryBuffer\0":
        unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
    commit_geometry = b"rtcCommitGeometry\0": unsafe extern "C" fn(Handle),
    release_geometry = b"rtcReleaseGeometry\0": unsafe extern "C" fn(Handle),
    new_scene = b"rtcNewScene\0": unsafe extern "C" fn(Handle) -> Handle,
    scene_flags = b"rtcSetSceneFlags\0": unsafe extern "C" fn(Handle, c_int),
    scene_quality = b"rtcSetSceneBuildQuality\0": unsafe extern "C" fn(Handle, c_int),
    attach = b"rtcAttachGeometryByID\0": unsafe extern "C" fn(Handle, Handle, c_uint),
    commit_scene = b"rtcCommitScene\0": unsafe extern "C" fn(Handle),
    release_scene = b"rtcReleaseScene\0": unsafe extern "C" fn(Handle),
    intersect1 = b"rtcIntersect1\0": Single<RayHitPacket<Align16, 1>>,
    intersect8 = b"rtcIntersect8\0": Wide<RayHitPacket<Align32, 8>>,
    intersect16 = b"rtcIntersect16\0": Wide<RayHitPacket<Align64, 16>>,
    occluded1 = b"rtcOccluded1\0": Single<RayPacket<Align16, 1>>,
    occluded8 = b"rtcOccluded8\0": Wide<RayPacket<Align32, 8>>,
    occluded16 = b"rtcOccluded16\0": Wide<RayPacket<Align64, 16>>,
}
