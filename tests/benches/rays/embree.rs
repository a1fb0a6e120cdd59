//! Embree 4, loaded at run time: of its interface only what is used here is declared (see `embree4/rtcore.h`).

use std::{
    ffi::{OsStr, c_char, c_int, c_uint, c_void},
    mem,
};

use libloading::Library;
use tessera_engine::{description::Matrix, shape::Ray};

use super::scenes::Model;

type Handle = *mut c_void;

const TRIANGLES: c_int = 0;
const INDICES: c_int = 0;
const VERTICES: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const INSTANCE: c_int = 121;
const ROWS: c_int = 0x9134;
const QUALITY_HIGH: c_int = 2;
const ROBUST: c_int = 4;
const COHERENT: c_int = 1 << 16;

#[repr(C, align(16))]
struct OneRay {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

#[repr(C, align(16))]
struct OneHit {
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: [u32; 2],
}

#[repr(C, align(16))]
struct RayAndHit {
    ray: OneRay,
    hit: OneHit,
}

/// Eight rays and their hits: origin, near, direction, time, far; mask, id, flags; normal, u, v; primitive, geometry, instance.
#[repr(C, align(32))]
struct Packet {
    ray: [[f32; 8]; 9],
    numbers: [[u32; 8]; 3],
    hit: [[f32; 8]; 5],
    ids: [[u32; 8]; 4],
}

#[repr(C, align(32))]
struct Valid([c_int; 8]);

#[repr(C)]
struct Arguments {
    flags: c_int,
    features: c_int,
    pointers: [usize; 3],
    padding: [f32; 4],
}

impl Arguments {
    fn new(flags: c_int) -> Self {
        Self { flags, features: -1, pointers: [0; 3], padding: [0.0; 4] }
    }
}

/// The library, with a device of one thread.
pub struct Embree {
    library: Library,
    device: Handle,
}

/// A tree of Embree's. It lives as long as the process.
pub struct Tree {
    scene: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut RayAndHit, *mut Arguments),
    occluded: unsafe extern "C" fn(Handle, *mut OneRay, *mut Arguments),
    intersect8: unsafe extern "C" fn(*const c_int, Handle, *mut Packet, *mut Arguments),
}

impl Embree {
    pub fn load(path: &OsStr) -> Self {
        // SAFETY: the user named Embree's library, whose initialisation does nothing unusual.
        let library = unsafe { Library::new(path) }.expect("Embree's library can be loaded");
        let mut embree = Self { library, device: std::ptr::null_mut() };
        // SAFETY: the signatures are those of Embree 4.
        embree.device = unsafe { embree.function::<unsafe extern "C" fn(*const c_char) -> Handle>("rtcNewDevice")(c"threads=1".as_ptr()) };
        assert!(!embree.device.is_null(), "Embree makes no device");
        embree
    }

    /// # Safety
    /// `F` is the function's type.
    unsafe fn function<F: Copy>(&self, name: &str) -> F {
        // SAFETY: by this function's own condition.
        *unsafe { self.library.get::<F>(name.as_bytes()) }.unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Builds a tree of high quality.
    pub fn scene(&self, model: &Model, robust: bool) -> Tree {
        // SAFETY: the signatures are those of Embree 4, and buffers are as long as what is copied into them.
        unsafe {
            let geometry = self.function::<unsafe extern "C" fn(Handle, c_int) -> Handle>("rtcNewGeometry")(self.device, TRIANGLES);
            let buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> Handle =
                self.function("rtcSetNewGeometryBuffer");
            let vertices = buffer(geometry, VERTICES, 0, FLOAT3, 12, model.positions.len());
            model.positions.as_ptr().copy_to_nonoverlapping(vertices.cast(), model.positions.len());
            let indices = buffer(geometry, INDICES, 0, UINT3, 12, model.triangles.len());
            model.triangles.as_ptr().copy_to_nonoverlapping(indices.cast(), model.triangles.len());
            self.function::<unsafe extern "C" fn(Handle)>("rtcCommitGeometry")(geometry);
            let mesh = self.committed(robust, &[geometry]);
            let scene = if model.places.is_empty() { mesh } else { self.committed(robust, &self.instances(mesh, &model.places)) };
            Tree {
                scene,
                intersect: self.function("rtcIntersect1"),
                occluded: self.function("rtcOccluded1"),
                intersect8: self.function("rtcIntersect8"),
            }
        }
    }
}

impl Embree {
    /// A scene of what was committed.
    ///
    /// # Safety
    /// The geometries are Embree's.
    unsafe fn committed(&self, robust: bool, geometries: &[Handle]) -> Handle {
        // SAFETY: the signatures are those of Embree 4.
        unsafe {
            let scene = self.function::<unsafe extern "C" fn(Handle) -> Handle>("rtcNewScene")(self.device);
            let set: unsafe extern "C" fn(Handle, c_int) = self.function("rtcSetSceneFlags");
            set(scene, if robust { ROBUST } else { 0 });
            let set: unsafe extern "C" fn(Handle, c_int) = self.function("rtcSetSceneBuildQuality");
            set(scene, QUALITY_HIGH);
            let attach = self.function::<unsafe extern "C" fn(Handle, Handle) -> c_uint>("rtcAttachGeometry");
            geometries.iter().for_each(|geometry| _ = attach(scene, *geometry));
            self.function::<unsafe extern "C" fn(Handle)>("rtcCommitScene")(scene);
            scene
        }
    }

    /// A scene at many places.
    ///
    /// # Safety
    /// The scene is Embree's.
    unsafe fn instances(&self, scene: Handle, places: &[Matrix]) -> Vec<Handle> {
        // SAFETY: the signatures are those of Embree 4, and a place is twelve numbers by rows.
        unsafe {
            let new = self.function::<unsafe extern "C" fn(Handle, c_int) -> Handle>("rtcNewGeometry");
            let show = self.function::<unsafe extern "C" fn(Handle, Handle)>("rtcSetGeometryInstancedScene");
            let put = self.function::<unsafe extern "C" fn(Handle, c_uint, c_int, *const f32)>("rtcSetGeometryTransform");
            let commit = self.function::<unsafe extern "C" fn(Handle)>("rtcCommitGeometry");
            let instance = |place: &Matrix| {
                let (instance, rows) = (new(self.device, INSTANCE), place.map(|row| row.map(|x| x as f32)));
                show(instance, scene);
                put(instance, 0, ROWS, rows.as_flattened().as_ptr());
                commit(instance);
                instance
            };
            places.iter().map(instance).collect()
        }
    }
}

impl Tree {
    /// Distances; of rays that only ask whether anything is there, 0 or infinity.
    pub fn trace(&self, rays: &[Ray], any: bool, out: &mut Vec<f64>) {
        let mut arguments = Arguments::new(0);
        for ray in rays {
            let mut one = OneRay::from(ray);
            let distance = if any {
                // SAFETY: a scene that was committed, and a ray as Embree wants it.
                unsafe { (self.occluded)(self.scene, &raw mut one, &raw mut arguments) };
                if one.far < 0.0 { 0.0 } else { f64::INFINITY }
            } else {
                let hit = OneHit { normal: [0.0; 3], u: 0.0, v: 0.0, primitive: !0, geometry: !0, instance: [!0; 2] };
                let mut both = RayAndHit { ray: one, hit };
                // SAFETY: a scene that was committed, and a ray as Embree wants it.
                unsafe { (self.intersect)(self.scene, &raw mut both, &raw mut arguments) };
                if both.hit.geometry == !0 { f64::INFINITY } else { f64::from(both.ray.far) }
            };
            out.push(distance);
        }
    }

    /// The same for rays of which every eight belong together.
    pub fn trace_packets(&self, rays: &[Ray], out: &mut Vec<f64>) {
        let (mut arguments, valid) = (Arguments::new(COHERENT), Valid([-1; 8]));
        for eight in rays.chunks(8) {
            // SAFETY: numbers may be 0.
            let mut packet: Packet = unsafe { mem::zeroed() };
            for (lane, ray) in eight.iter().chain(std::iter::repeat(&eight[0])).take(8).enumerate() {
                let one = OneRay::from(ray);
                for axis in 0..3 {
                    packet.ray[axis][lane] = one.origin[axis];
                    packet.ray[4 + axis][lane] = one.direction[axis];
                }
                packet.ray[8][lane] = one.far;
                packet.numbers[0][lane] = one.mask;
            }
            packet.ids = [[!0; 8]; 4];
            // SAFETY: a scene that was committed, and rays as Embree wants them.
            unsafe { (self.intersect8)(valid.0.as_ptr(), self.scene, &raw mut packet, &raw mut arguments) };
            let distance = |lane: usize| if packet.ids[1][lane] == !0 { f64::INFINITY } else { f64::from(packet.ray[8][lane]) };
            out.extend((0..eight.len()).map(distance));
        }
    }
}

impl From<&Ray> for OneRay {
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_vec3().into(),
            near: 0.0,
            direction: ray.direction.as_vec3().into(),
            time: 0.0,
            far: ray.t_max as f32,
            mask: !0,
            id: 0,
            flags: 0,
        }
    }
}
