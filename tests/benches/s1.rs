//! Speed of scene S1 (1024 x 768, one sample a pixel) on one thread: `cargo bench -p tessera-tests --bench s1`.
//!
//! Prints medians of runs taken in turns, because a machine's speed drifts: the time of one part against the sum of the times of parts of
//! 48 x 64 pixels and, where `povray` is on the path, the CPU time of a whole process of ours, EXR included, against POV-Ray's.

use std::{
    env, fs,
    path::Path,
    process::{Command, Stdio},
    sync::atomic::AtomicBool,
    time::Instant,
};

use tessera_engine::{
    description::{Frame, MemoryAssets},
    film::Film,
    output::exr::{self, Identity, PixelType},
    part::{self, Rect, SampleRange},
    scene::Scene,
};
use tessera_tests::s1::{self, Ball, Kind};

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 768;
const ROUNDS: usize = 9;

fn main() {
    let arguments: Vec<String> = env::args().collect();
    match arguments.iter().position(|argument| argument == "--whole-program") {
        Some(at) => whole_program(Path::new(&arguments[at + 1])),
        None => compare(),
    }
}

fn compare() {
    parts();
    let folder = tempfile::tempdir().expect("a temporary folder");
    if Command::new("povray").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok() {
        povray(folder.path());
    } else {
        println!("povray is not on the path: no comparison with it");
    }
}

fn compile(frame: &Frame) -> Scene {
    Scene::compile(frame, &MemoryAssets::default()).expect("S1 compiles")
}

fn whole() -> Rect {
    Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT }
}

/// Seconds of rendering one part.
fn seconds(scene: &Scene, rect: Rect) -> f64 {
    let start = Instant::now();
    let part = part::render(scene, rect, SampleRange { first: 0, count: 1 }, &AtomicBool::new(false));
    let seconds = start.elapsed().as_secs_f64();
    std::hint::black_box(part).expect("nobody cancels");
    seconds
}

fn parts() {
    let scene = compile(&s1::frame(WIDTH, HEIGHT));
    let cells = (0..HEIGHT).step_by(64).flat_map(|y| (0..WIDTH).step_by(48).map(move |x| (x, y)));
    let grid: Vec<Rect> = cells.map(|(x, y)| Rect { x, y, width: 48.min(WIDTH - x), height: 64.min(HEIGHT - y) }).collect();
    let rounds: Vec<_> = (0..ROUNDS).map(|_| (seconds(&scene, whole()), grid.iter().map(|&rect| seconds(&scene, rect)).sum())).collect();
    let one = median(rounds.iter().map(|round| round.0));
    let sum: f64 = median(rounds.iter().map(|round| round.1));
    println!("one part {one:.4} s; {} parts of 48 x 64 px in sum {sum:.4} s; ratio {:.4} (medians of {ROUNDS})", grid.len(), sum / one);
}

fn whole_program(path: &Path) {
    let frame = s1::frame(WIDTH, HEIGHT);
    let scene = compile(&frame);
    let part = part::render(&scene, whole(), SampleRange { first: 0, count: 1 }, &AtomicBool::new(false)).expect("nobody cancels");
    let film = Film::from_pixels(WIDTH, HEIGHT, part.pixels).expect("the part is the whole frame");
    let identity = Identity::new(frame.hash().expect("frames can be coded"), frame.seed);
    exr::write(path, &film, PixelType::Half, &identity).expect("the folder can be written");
}

fn povray(folder: &Path) {
    let scene = folder.join("s1.pov");
    fs::write(&scene, pov_scene()).expect("the folder can be written");
    let ours = || {
        let mut command = Command::new(env::current_exe().expect("we run"));
        command.arg("--whole-program").arg(folder.join("s1.exr"));
        command
    };
    let theirs = || {
        let mut command = Command::new("povray");
        command.args([format!("+I{}", scene.display()), format!("+W{WIDTH}"), format!("+H{HEIGHT}")]);
        command.args(["-A", "-D", "+FE", "+WT1"]).arg(format!("+O{}", folder.join("pov.exr").display()));
        command
    };
    let rounds: Vec<_> = (0..ROUNDS).map(|_| (cpu_seconds(ours()), cpu_seconds(theirs()))).collect();
    let (ours, theirs) = (median(rounds.iter().map(|round| round.0)), median(rounds.iter().map(|round| round.1)));
    println!(
        "CPU time, EXR of half floats included: ours {ours:.2} s, POV-Ray's {theirs:.2} s; ratio {:.2} (medians of {ROUNDS})",
        theirs / ours
    );
}

/// CPU seconds of a child process with all its threads.
fn cpu_seconds(mut command: Command) -> f64 {
    let before = children_seconds();
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status().expect("the program starts");
    assert!(status.success(), "{command:?} failed");
    children_seconds() - before
}

/// User and system time of all children that have ended: fields 16 and 17 of `/proc/self/stat`, in ticks of 10 ms (proc(5)).
fn children_seconds() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").expect("Linux");
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    after_name.split_whitespace().skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<_> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// S1 in POV-Ray's language. The negative `right` makes its world right-handed; the checker is shifted by half a cell so that `floor(y)` is
/// constant on the plane.
fn pov_scene() -> String {
    let vector = |[x, y, z]: [f64; 3]| format!("<{x}, {y}, {z}>");
    let [eye, target] = s1::CAMERA.map(vector);
    let matte = "finish { ambient 0 diffuse 1 specular 0 }";
    let mut scene = format!(
        "#version 3.7; global_settings {{ assumed_gamma 1.0 max_trace_level 8 }} background {{ rgb {} }}\n\
         camera {{ perspective location {eye} right -x*4/3 up y angle 45 look_at {target} }}\n\
         plane {{ y, 0 texture {{ pigment {{ checker rgb {} rgb {} translate -0.5*y }} {matte} }} }}\n",
        vector(s1::BACKGROUND),
        s1::FLOOR[0],
        s1::FLOOR[1],
    );
    for (position, color) in s1::LIGHTS {
        scene += &format!("light_source {{ {} rgb {} }}\n", vector(position), vector(color));
    }
    for Ball { center, radius, kind } in s1::balls() {
        let look = match kind {
            Kind::Diffuse(albedo) => format!("texture {{ pigment {{ rgb {} }} {matte} }}", vector(albedo)),
            Kind::Mirror => "texture { pigment { rgb 0 } finish { ambient 0 diffuse 0 specular 0 reflection { rgb 0.9 } } }".to_owned(),
            Kind::Glass => "texture { pigment { rgbt <1, 1, 1, 1> } finish { ambient 0 diffuse 0 specular 0 \
                            reflection { 0, 1 fresnel on } conserve_energy } } interior { ior 1.5 }"
                .to_owned(),
        };
        scene += &format!("sphere {{ {}, {radius} {look} }}\n", vector(center));
    }
    scene
}
