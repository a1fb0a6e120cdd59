//! How a frame becomes parts.

use std::collections::BTreeMap;
use std::fmt;

use tessera_engine::part::Rect;

use super::CostMap;
use crate::limits::PARTS_PER_JOB;

/// Rectangles of `width` x `height` pixels, row by row, smaller at the right and lower border. Both edges at least 1.
pub fn grid(frame_width: u32, frame_height: u32, width: u32, height: u32) -> Vec<Rect> {
    let spans = |length: u32, step: u32| (0..length).step_by(step.max(1) as usize).map(move |at| (at, step.max(1).min(length - at)));
    spans(frame_height, height)
        .flat_map(|(y, height)| spans(frame_width, width).map(move |(x, width)| Rect { x, y, width, height }))
        .collect()
}

/// `count` horizontal strips, whose heights differ by one row at the most; as many as there are rows where `count` is above that.
pub fn strips(frame_width: u32, frame_height: u32, count: u32) -> Vec<Rect> {
    let count = u64::from(count.clamp(1, frame_height));
    let edge = |i: u64| (u64::from(frame_height) * i / count) as u32;
    (0..count).map(|i| Rect { x: 0, y: edge(i), width: frame_width, height: edge(i + 1) - edge(i) }).collect()
}

/// Predicted seconds of a rectangle on a node of power 1: the integral of the cost map over it.
pub fn cost_of(rect: Rect, costs: &CostMap) -> f64 {
    let (rows, columns) = (spans(rect.y, rect.height, costs.cell, costs.rows), spans(rect.x, rect.width, costs.cell, costs.columns));
    let mut cost = 0.0;
    for (row, height) in rows {
        for (column, width) in columns.clone() {
            let index = row as usize * costs.columns as usize + column as usize;
            cost += costs.seconds_per_pixel.get(index).unwrap_or(&0.0) * f64::from(width) * f64::from(height);
        }
    }
    cost
}

/// Cells along one axis that `from .. from + length` meets, with the pixels it has in each. Pixels beyond the last cell belong to that.
fn spans(from: u32, length: u32, cell: u32, cells: u32) -> impl Iterator<Item = (u32, u32)> + Clone {
    let (cell, last, end) = (cell.max(1), cells.saturating_sub(1), from.saturating_add(length));
    let index = move |at: u32| (at / cell).min(last);
    (index(from)..=index(end.saturating_sub(1))).map(move |i| {
        let upper = if i == last { end } else { end.min((i + 1).saturating_mul(cell)) };
        (i, upper.saturating_sub(from.max(i * cell)))
    })
}

/// What is wrong with a split. Rectangles are counted from 1, as Lua does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitError {
    /// There are none, or too many.
    Count(usize),
    /// It has no pixels.
    Empty(usize, Rect),
    /// It reaches beyond the frame.
    Outside(usize, Rect, u32, u32),
    /// Two share pixels.
    Overlap(usize, Rect, usize, Rect),
    /// No rectangle has this pixel.
    Gap(u32, u32),
}

impl fmt::Display for SplitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let show = |r: &Rect| format!("(x = {}, y = {}, width = {}, height = {})", r.x, r.y, r.width, r.height);
        match self {
            Self::Count(0) => write!(f, "the split has no rectangles"),
            Self::Count(count) => write!(f, "the split has {count} rectangles; {PARTS_PER_JOB} are the most"),
            Self::Empty(i, r) => write!(f, "rectangle {i} {} has no pixels", show(r)),
            Self::Outside(i, r, w, h) => write!(f, "rectangle {i} {} reaches beyond the frame of {w} x {h} pixels", show(r)),
            Self::Overlap(i, a, j, b) => write!(f, "rectangles {i} {} and {j} {} overlap", show(a), show(b)),
            Self::Gap(x, y) => write!(f, "no rectangle covers the pixel x = {x}, y = {y}"),
        }
    }
}

impl std::error::Error for SplitError {}

/// Checks that rectangles tile a frame: none empty or beyond it, no overlap, no gap. O(n log n).
///
/// # Errors
/// The first thing that is wrong.
pub fn validate(rects: &[Rect], width: u32, height: u32) -> Result<(), SplitError> {
    if rects.is_empty() || rects.len() > PARTS_PER_JOB {
        return Err(SplitError::Count(rects.len()));
    }
    for (i, rect) in (1..).zip(rects) {
        let fits = |from: u32, length: u32, end: u32| from.checked_add(length).is_some_and(|to| to <= end);
        if rect.area() == 0 {
            return Err(SplitError::Empty(i, *rect));
        }
        if !fits(rect.x, rect.width, width) || !fits(rect.y, rect.height, height) {
            return Err(SplitError::Outside(i, *rect, width, height));
        }
    }
    sweep(rects, width, height)
}

/// Moves a row down the frame over the edges of rectangles, and keeps those that it crosses by their left column.
fn sweep(rects: &[Rect], width: u32, height: u32) -> Result<(), SplitError> {
    let mut opening: Vec<usize> = (0..rects.len()).collect();
    opening.sort_unstable_by_key(|i| (rects[*i].y, rects[*i].x));
    let mut closing = opening.clone();
    closing.sort_unstable_by_key(|i| rects[*i].y + rects[*i].height);
    let (mut opening, mut closing) = (opening.into_iter().peekable(), closing.into_iter().peekable());
    let mut crossed: BTreeMap<u32, usize> = BTreeMap::new();
    let (mut covered, mut y) = (0, 0);
    while y < height {
        while let Some(i) = closing.next_if(|i| rects[*i].y + rects[*i].height <= y) {
            crossed.remove(&rects[i].x);
            covered -= rects[i].width;
        }
        while let Some(i) = opening.next_if(|i| rects[*i].y <= y) {
            open(rects, &mut crossed, i)?;
            covered += rects[i].width;
        }
        if covered < width {
            return Err(SplitError::Gap(first_uncovered(rects, &crossed), y));
        }
        let next_open = opening.peek().map_or(height, |i| rects[*i].y);
        let next_close = closing.peek().map_or(height, |i| rects[*i].y + rects[*i].height);
        y = next_open.min(next_close);
    }
    Ok(())
}

fn open(rects: &[Rect], crossed: &mut BTreeMap<u32, usize>, i: usize) -> Result<(), SplitError> {
    let (x, end) = (rects[i].x, rects[i].x + rects[i].width);
    if let Some((_, other)) = crossed.range(..end).next_back()
        && rects[*other].x + rects[*other].width > x
    {
        let (first, second) = (i.min(*other), i.max(*other));
        return Err(SplitError::Overlap(first + 1, rects[first], second + 1, rects[second]));
    }
    crossed.insert(x, i);
    Ok(())
}

fn first_uncovered(rects: &[Rect], crossed: &BTreeMap<u32, usize>) -> u32 {
    crossed.iter().fold(0, |x, (left, i)| if *left == x { x + rects[*i].width } else { x })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same check by painting every pixel.
    fn painted(rects: &[Rect], width: u32, height: u32) -> bool {
        let mut count = vec![0u32; (width * height) as usize];
        for r in rects {
            if r.area() == 0 || r.x + r.width > width || r.y + r.height > height {
                return false;
            }
            for y in r.y..r.y + r.height {
                (r.x..r.x + r.width).for_each(|x| count[(y * width + x) as usize] += 1);
            }
        }
        count.iter().all(|n| *n == 1)
    }

    proptest::proptest! {
        #[test]
        fn validate_agrees_with_painting(cuts in proptest::collection::vec((0u32..12, 0u32..9, 0u32..5, 0u32..5), 0..4), size in 1u32..6) {
            // A true tiling, with rectangles knocked out of place.
            let mut rects = grid(12, 9, size, size + 1);
            for (x, y, width, height) in cuts {
                let at = (x + 12 * y) as usize % rects.len();
                if width + height > 6 { rects.swap_remove(at); } else { rects[at] = Rect { x, y, width, height }; }
                if rects.is_empty() { break; }
            }
            proptest::prop_assert_eq!(validate(&rects, 12, 9).is_ok(), !rects.is_empty() && painted(&rects, 12, 9));
        }
    }

    #[test]
    fn errors_name_the_place() {
        let rect = |x, y, width, height| Rect { x, y, width, height };
        let says = |rects: &[Rect]| validate(rects, 10, 10).unwrap_err().to_string();
        assert_eq!(says(&[]), "the split has no rectangles");
        assert_eq!(says(&[rect(0, 0, 10, 4), rect(0, 4, 0, 6)]), "rectangle 2 (x = 0, y = 4, width = 0, height = 6) has no pixels");
        assert_eq!(
            says(&[rect(0, 0, 11, 10)]),
            "rectangle 1 (x = 0, y = 0, width = 11, height = 10) reaches beyond the frame of 10 x 10 pixels"
        );
        assert!(says(&[rect(u32::MAX, 0, 2, 10)]).contains("beyond the frame"));
        assert_eq!(
            says(&[rect(0, 0, 10, 10), rect(4, 4, 2, 2)]),
            "rectangles 1 (x = 0, y = 0, width = 10, height = 10) and 2 (x = 4, y = 4, width = 2, height = 2) overlap"
        );
        assert_eq!(says(&[rect(0, 0, 10, 5), rect(0, 5, 3, 5), rect(4, 5, 6, 5)]), "no rectangle covers the pixel x = 3, y = 5");
        assert_eq!(says(&[rect(0, 0, 10, 5)]), "no rectangle covers the pixel x = 0, y = 5");
        assert_eq!(says(&vec![rect(0, 0, 1, 1); PARTS_PER_JOB + 1]), "the split has 300001 rectangles; 300000 are the most");
    }

    #[test]
    fn strips_are_even_and_tile() {
        for (height, count) in [(768, 15), (7, 3), (3, 9), (1, 1)] {
            let strips = strips(40, height, count);
            assert_eq!(strips.len() as u32, count.min(height));
            validate(&strips, 40, height).unwrap();
            let heights = || strips.iter().map(|strip| strip.height);
            assert!(heights().max().unwrap() - heights().min().unwrap() <= 1);
        }
    }

    #[test]
    fn as_many_parts_as_allowed_are_checked_in_no_time() {
        // 447 x 447 cells of 1 pixel: quadratic work would be 4e10 comparisons.
        validate(&grid(447, 447, 1, 1), 447, 447).unwrap();
        validate(&strips(65_536, 65_536, 65_536), 65_536, 65_536).unwrap();
    }

    #[test]
    fn costs_of_a_tiling_add_up_to_the_whole() {
        let costs = CostMap { cell: 8, columns: 4, rows: 3, seconds_per_pixel: (0..12).map(|i| f64::from(i * i)).collect() };
        let by_pixel: f64 = (0..23 * 30).map(|i| f64::from(i % 30 / 8 + i / 30 / 8 * 4).powi(2)).sum();
        for (width, height) in [(30, 23), (1, 1), (7, 5), (8, 8), (30, 1)] {
            let sum: f64 = grid(30, 23, width, height).iter().map(|rect| cost_of(*rect, &costs)).sum();
            assert!((sum - by_pixel).abs() < 1e-6, "{width} x {height}: {sum} instead of {by_pixel}");
        }
    }
}
