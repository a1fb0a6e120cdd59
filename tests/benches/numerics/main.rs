//! The cases of numerical stability that the engine promises, geometry and transforms: `cargo bench -p tessera-tests --bench numerics -- [--rays 1e9]
//! [CASE...]`. A case is given by its number or by words of what it counts.
//!
//! Every case asks the engine about many rays, alone and in streams, on all cores, and prints how many it answered otherwise than geometry does. It
//! passes if they are no larger a share of all than `allowed`; else the first failures are printed with the bits of their rays. `--rays` replaces the
//! counts of the table.

mod closed;
mod double;
mod exact;
mod gallery;
mod needles;
mod placed;
mod scenes;
mod spawned;
mod trees;
mod trial;

use std::{process::ExitCode, time::Instant};

use trial::Tally;

/// A promise and how it is tested.
struct Case {
    number: u32,
    /// What counts as a failure.
    what: &'static str,
    /// Rays by default.
    rays: u64,
    /// Share of the rays that may fail.
    allowed: f64,
    run: fn(u64) -> Tally,
}

impl Case {
    /// By its number or by words of what it counts.
    fn is_called(&self, name: &str) -> bool {
        name.parse().map_or_else(|_| self.what.contains(name), |number: u32| number == self.number)
    }
}

const fn case(number: u32, what: &'static str, rays: u64, run: fn(u64) -> Tally) -> Case {
    Case { number, what, rays, allowed: 0.0, run }
}

/// All of them, by number.
const CASES: &[Case] = &[
    case(1, "rays at edges of closed meshes leak", 10_000_000, closed::edges),
    case(1, "rays at vertices of closed meshes leak", 10_000_000, closed::vertices),
    case(1, "rays at edges, rims and apexes of other closed shapes leak", 2_000_000, closed::rims),
    case(2, "leaks at the offset (148376, 1234, -223423)", 400_000, closed::offset),
    case(2, "leaks at the scale 2^-60", 1_000_000, closed::tiny),
    case(2, "leaks at the scale 2^60", 1_000_000, closed::huge),
    case(3, "trees find another hit than brute force", 300_000, trees::brute_force),
    case(4, "rays at edges of closed meshes cross them an odd number of times", 1_000_000, closed::parity_of_edges),
    case(4, "rays at vertices of closed meshes cross them an odd number of times", 1_000_000, closed::parity_of_vertices),
    case(4, "walks through closed meshes do not go in and out by turns", 500_000, closed::walks),
    case(5, "needles, points and duplicates: hits that are no numbers or differ", 1_000_000, needles::finite),
    case(5, "degenerate and duplicate triangles change a closed mesh", 500_000, needles::dirty),
    case(5, "tiny triangles are hit by rays that pass far beside them", 2_000_000, needles::specks),
    case(6, "spawned rays meet their surface again or lose the other side", 10_000_000, spawned::again),
    case(6, "spawned rays skip a neighbour beyond both bounds", 1_000_000, spawned::neighbours),
    case(7, "shells r and r (1 + 4e-5) are not told apart", 1_000_000, spawned::shells),
    case(8, "of coincident surfaces another one wins than the first", 200_000, trees::coincident),
    Case { allowed: 1e-6, ..case(9, "grazing rays, cosines down to 1e-7, do not do as in exact arithmetic", 2_000_000, exact::grazing) },
    case(10, "spheres up to 1e12 radii away: points off by 4 u distance / radius, or lost", 2_000_000, exact::far_spheres),
    case(11, "roots of cones near the apex are others than those of the quadratic", 1_000_000, exact::apexes),
    case(12, "pixels differ where all lengths are scaled by 2^k, |k| <= 60", 0, gallery::scaled),
    case(13, "pixels differ where lights are scaled by 2^k, |k| <= 100", 0, gallery::lit),
    case(14, "pixels differ where the world is shifted by 1e12", 0, gallery::shifted),
    case(15, "a camera 1e6 sizes away: relative RMSE to parallel rays above 1e-3", 1 << 20, placed::far_camera),
    case(16, "a mesh mirrored by its place differs from one that is made so", 500_000, placed::mirrored),
    case(17, "impossible transforms of all objects are not refused by name", 0, placed::singular),
    case(18, "points in 16 nested places are off by more than the gamma bound", 500_000, placed::nested),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let (rays, chosen) = match parse(&arguments) {
        Ok(parsed) => parsed,
        Err(wrong) => {
            eprintln!("{wrong}; usage: numerics [--rays COUNT] [CASE...]");
            return ExitCode::from(2);
        }
    };
    if all_hold(rays, &chosen) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Runs the chosen cases, or all, and prints what came of them: with so many rays, or as many as the table says.
pub fn all_hold(rays: Option<u64>, chosen: &[String]) -> bool {
    println!("case  {:<72} {:>13} {:>10} {:>8} {:>8}", "counted as failures", "rays", "failures", "allowed", "seconds");
    let chosen = CASES.iter().filter(|case| chosen.is_empty() || chosen.iter().any(|name| case.is_called(name)));
    chosen.filter(|case| !passes(case, rays.unwrap_or(case.rays))).count() == 0
}

/// How many rays, where that is said, and which cases; all if there are none.
fn parse(arguments: &[String]) -> Result<(Option<u64>, Vec<String>), String> {
    let (mut rays, mut chosen, mut rest) = (None, Vec::new(), arguments.iter());
    while let Some(argument) = rest.next() {
        if argument == "--rays" {
            let count = rest.next().and_then(|count| count.parse::<f64>().ok()).filter(|count| *count >= 1.0);
            rays = Some(count.ok_or("--rays needs a number")? as u64);
        } else {
            let is_known = CASES.iter().any(|case| case.is_called(argument));
            chosen.push(is_known.then(|| argument.clone()).ok_or_else(|| format!("{argument} is no case"))?);
        }
    }
    Ok((rays, chosen))
}

/// Runs a case and prints what came of it.
fn passes(case: &Case, rays: u64) -> bool {
    let begin = Instant::now();
    let Tally { rays, failures, replays } = (case.run)(rays);
    let passes = failures as f64 <= case.allowed * rays as f64;
    let verdict = if passes { "" } else { "  FAILED" };
    let seconds = begin.elapsed().as_secs_f64();
    println!("{:>4}  {:<72} {rays:>13} {failures:>10} {:>8} {seconds:>8.1}{verdict}", case.number, case.what, case.allowed);
    if !passes {
        replays.iter().for_each(|(_, replay)| println!("      {replay}"));
    }
    passes
}
