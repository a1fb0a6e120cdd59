//! Rendering in this process, on all its threads, without a farm.

use std::{
    num::NonZero,
    panic,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::Instant,
};

use tessera_engine::{
    film::Film,
    part::{self, Counters, Rect, SampleRange},
    scene::Scene,
};

use crate::{
    error::{Error, ExitCode, Result},
    schedule::{probe::Cells, split},
};

/// Edge of the squares that threads take in turn.
const SQUARE: u32 = 32;

/// Cores that this process may use.
pub fn threads() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// Renders a whole frame with the given number of samples a pixel on all threads. `done` hears of every rendered rectangle.
///
/// # Errors
/// None in practice: [`ExitCode::Internal`] where a part does not fit on the film.
pub fn frame(scene: &Scene, samples: u64, done: impl Fn(Rect) + Sync) -> Result<Film> {
    let squares = split::grid(scene.film.width, scene.film.height, SQUARE, SQUARE);
    parts(scene, &squares, SampleRange { first: 0, count: samples }, threads(), done).map(|(film, _)| film)
}

/// Renders these samples of parts of a frame with so many threads, which take them in the order given; and counts the work.
///
/// # Errors
/// [`ExitCode::Internal`] where a part does not fit on the film.
pub fn parts(scene: &Scene, rects: &[Rect], samples: SampleRange, threads: usize, done: impl Fn(Rect) + Sync) -> Result<(Film, Counters)> {
    let film = Film::with_aovs(scene.film.width, scene.film.height, scene.aovs);
    let whole = Mutex::new((film, Counters::default()));
    share_out(rects, threads, |rect| {
        let rendered = part::render(scene, *rect, samples, &AtomicBool::new(false)).map_err(internal)?;
        let (film, counters) = &mut *whole.lock().unwrap_or_else(PoisonError::into_inner);
        film.place(&rendered).map_err(internal)?;
        *counters += rendered.counters;
        done(*rect);
        Ok(())
    })?;
    Ok(whole.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Measures every cell of a probe: `(cell, seconds that one thread takes for one sample of a pixel)`, in the order of the cells.
///
/// # Errors
/// None in practice.
pub fn probe(scene: &Scene, cells: &Cells) -> Result<Vec<(u32, f64)>> {
    let measured = Mutex::new(Vec::new());
    let all: Vec<u32> = (0..cells.count()).collect();
    share_out(&all, threads(), |&cell| {
        let start = Instant::now();
        let pixels = part::probe(scene, cells.rect(cell), cells.stride, &AtomicBool::new(false)).map_err(internal)?;
        let seconds = start.elapsed().as_secs_f64() / pixels.max(1) as f64;
        measured.lock().unwrap_or_else(PoisonError::into_inner).push((cell, seconds));
        Ok(())
    })?;
    let mut measured = measured.into_inner().unwrap_or_else(PoisonError::into_inner);
    measured.sort_by_key(|(cell, _)| *cell);
    Ok(measured)
}

/// Threads take items in turn until none is left or one has failed.
fn share_out<T: Sync>(items: &[T], threads: usize, work: impl Fn(&T) -> Result<()> + Sync) -> Result<()> {
    let next = AtomicUsize::new(0);
    let lane = || {
        while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
            work(item)?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let lanes: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(lane)).collect();
        lanes.into_iter().try_for_each(|lane| lane.join().unwrap_or_else(|panicked| panic::resume_unwind(panicked)))
    })
}

fn internal(error: impl std::fmt::Display) -> Error {
    Error::new(ExitCode::Internal, error.to_string())
}
