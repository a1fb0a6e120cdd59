//! Rays against Embree, on one thread: `tests/compare/rays`, which fetches Embree, or, where `EMBREE_LIB` names its library, `cargo bench -p
//! tessera-tests --bench rays`. Names of scenes, or of sets of their rays (`hall/ao`), as arguments leave the others out.
//!
//! Prints, for every scene and set of rays, million rays a second of each contender in proportion to Embree's own default (single rays, build quality
//! high), and the share of rays whose hits differ from Embree's robust ones. Contenders take turns on chunks of rays, so that a machine whose
//! speed drifts is fair to all; a chunk counts with its median over all turns.

mod embree;
mod scenes;
mod sets;

use std::{hint::black_box, time::Instant};

use glam::DVec3;
use tessera_engine::{
    scene::{Scene, Tracer, Work},
    shape::Ray,
};

use embree::Embree;
use scenes::Model;
use sets::{Query, Set};

/// Rays that a contender traces before it is the next one's turn.
const CHUNK: usize = 1 << 14;

const TURNS: usize = 7;

/// Distances that differ by less, in proportion, are taken for the same: Embree computes in f32.
const SAME: f64 = 1e-3;

/// Traces a chunk; adds the distances that it finds, or infinity.
type Trace<'a> = Box<dyn FnMut(&[Ray], &mut Vec<f64>) + 'a>;

struct Contender<'a> {
    name: &'static str,
    trace: Trace<'a>,
    /// Seconds of each turn, by chunk.
    seconds: Vec<Vec<f64>>,
    hits: Vec<f64>,
}

impl<'a> Contender<'a> {
    fn new(name: &'static str, trace: impl FnMut(&[Ray], &mut Vec<f64>) + 'a) -> Self {
        Self { name, trace: Box::new(trace), seconds: Vec::new(), hits: Vec::new() }
    }

    /// Seconds for all chunks, each at its median.
    fn total(&self) -> f64 {
        self.seconds.iter().map(|turns| median(turns)).sum()
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn main() {
    let names: Vec<String> = std::env::args().skip(1).filter(|name| !name.starts_with('-')).collect();
    let Some(library) = std::env::var_os("EMBREE_LIB") else {
        println!("EMBREE_LIB is not set: nothing to compare with; run tests/compare/rays");
        return;
    };
    let embree = Embree::load(&library);
    let mut ratios = Vec::new();
    let is_asked =
        |scene: &str, set: &str| names.is_empty() || names.iter().any(|name| *name == scene || *name == format!("{scene}/{set}"));
    for (scene, make) in scenes::ALL {
        let is_needed = names.is_empty() || names.iter().any(|name| name.split('/').next() == Some(scene));
        if let Some(model) = is_needed.then(make).flatten() {
            compare(&embree, &model, |set| is_asked(scene, set), &mut ratios);
        }
    }
    println!("geometric mean over {} sets: {:.3}", ratios.len(), geometric_mean(&ratios));
}

fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

fn compare(embree: &Embree, model: &Model, is_asked: impl Fn(&str) -> bool, ratios: &mut Vec<f64>) {
    let begin = Instant::now();
    let scene = model.compile();
    let ours = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let fast = embree.scene(model, false);
    let theirs = begin.elapsed().as_secs_f64();
    let robust = embree.scene(model, true);
    println!("{}: {} triangles; compiled in {ours:.2} s, Embree's tree in {theirs:.2} s", model.name, model.triangles.len());
    for set in sets::of(model, &scene).into_iter().filter(|set| is_asked(set.name)) {
        let any = set.query == Query::Any;
        let mut contenders = vec![
            Contender::new("embree", |rays, out| fast.trace(rays, any, out)),
            Contender::new("robust", |rays, out| robust.trace(rays, any, out)),
            Contender::new("single", |rays, out| trace(&scene, rays, any, false, out)),
            Contender::new("stream", |rays, out| trace(&scene, rays, any, true, out)),
        ];
        if set.is_coherent {
            contenders.push(Contender::new("packets", |rays, out| fast.trace_packets(rays, out)));
        }
        ratios.push(race(&set, &mut contenders));
    }
}

/// Lets contenders take turns; prints what came of it. Returns the speed of our streams in proportion to Embree's single rays.
fn race(set: &Set, contenders: &mut [Contender]) -> f64 {
    for chunk in set.rays.chunks(CHUNK) {
        for contender in &mut *contenders {
            contender.seconds.push(Vec::new());
            let known = contender.hits.len();
            (contender.trace)(chunk, &mut contender.hits);
            assert_eq!(contender.hits.len(), known + chunk.len(), "{} loses rays", contender.name);
        }
        for _ in 0..TURNS {
            for contender in &mut *contenders {
                let mut hits = Vec::with_capacity(chunk.len());
                let begin = Instant::now();
                (contender.trace)(black_box(chunk), &mut hits);
                let seconds = begin.elapsed().as_secs_f64();
                black_box(hits);
                contender.seconds.last_mut().expect("a chunk").push(seconds);
            }
        }
    }
    let (base, truth) = (contenders[0].total(), contenders[1].hits.clone());
    let figure = |contender: &Contender| {
        let differ = contender.hits.iter().zip(&truth).filter(|(a, b)| !is_same(**a, **b)).count();
        format!("{} {:.2} ({:.1e})", contender.name, base / contender.total(), differ as f64 / truth.len() as f64)
    };
    let figures: Vec<String> = contenders[1..].iter().map(figure).collect();
    println!("  {:<8} {:6.2} Mrays/s, {}", set.name, set.rays.len() as f64 / base * 1e-6, figures.join(", "));
    base / contenders[3].total()
}

fn is_same(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= SAME * b.abs()
}

/// Our distances, of one ray after the other or asked for all at once; of rays that only ask whether anything is there, 0 or infinity.
fn trace(scene: &Scene, rays: &[Ray], any: bool, at_once: bool, out: &mut Vec<f64>) {
    struct Rays<'r>(&'r [Ray], bool, bool, &'r mut Vec<f64>);
    impl Work for Rays<'_> {
        type Output = ();

        #[inline(always)]
        fn run(self, scene: impl Tracer) {
            let Self(rays, any, at_once, out) = self;
            let blocked = |is_blocked: bool| if is_blocked { 0.0 } else { f64::INFINITY };
            match (any, at_once) {
                (true, true) => scene.any_of(rays, |_| None, |_, _, _| true, |_, is_blocked| out.push(blocked(is_blocked))),
                (true, false) => out.extend(rays.iter().map(|ray| blocked(scene.any(ray, |_, _| true)))),
                (false, true) => scene.hits(rays, |_, hit| out.push(hit.map_or(f64::INFINITY, |hit| hit.t))),
                (false, false) => out.extend(rays.iter().map(|ray| scene.hit(ray).map_or(f64::INFINITY, |hit| hit.t))),
            }
        }
    }
    scene.run(Rays(rays, any, at_once, out));
}

/// A unit vector, evenly over all directions, from two numbers in [0, 1).
fn on_sphere(u: f64, v: f64) -> DVec3 {
    let (z, angle) = (1.0 - 2.0 * u, std::f64::consts::TAU * v);
    let radius = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
}

/// Numbers that are random enough for scenes and rays, the same in every run (O'Neill, "PCG", 2014).
struct Numbers(u64);

impl Numbers {
    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = ((self.0 >> 18) ^ self.0) >> 27;
        f64::from((x as u32).rotate_right((self.0 >> 59) as u32)) / 2f64.powi(32)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}
