//! Densities over the unit square, learnt from points, in quadtrees.

use glam::DVec2;

/// A square with more points is divided.
const MOST: usize = 8;

/// Squares are halved at most so many times: on an unfolded sphere, the smallest are seen under 0.1 degrees or so.
const DEEPEST: u32 = 10;

/// What quarters get beside what their points say, as points are few.
const EVEN_SHARE: f64 = 0.1;

/// The squares of all densities; each begins with one of its own.
#[derive(Debug, Default)]
pub struct Squares(Vec<Square>);

/// Four quarters: left and right, in the lower row and the upper one.
#[derive(Clone, Copy, Debug)]
struct Square {
    /// The share of the lower row.
    lower: f32,
    /// The share of the left one in each row.
    left: [f32; 2],
    /// Squares of these numbers; 0 for those that are not divided.
    inner: [u32; 4],
}

impl Squares {
    /// Adds the density of points in [0, 1)^2 with weights above 0, at least one: the number of its first square.
    pub fn add(&mut self, mut points: Vec<(DVec2, f64)>) -> u32 {
        self.divide(&mut points, DVec2::ZERO, 1.0, 0)
    }

    /// Adds the square of this corner and size.
    fn divide(&mut self, points: &mut [(DVec2, f64)], corner: DVec2, size: f64, depth: u32) -> u32 {
        let number = self.0.len();
        self.0.push(Square { lower: 0.5, left: [0.5; 2], inner: [0; 4] });
        let half = 0.5 * size;
        let middle = corner + DVec2::splat(half);
        let quarter = |point: DVec2| usize::from(point.x >= middle.x) + 2 * usize::from(point.y >= middle.y);
        points.sort_by_key(|(point, _)| quarter(*point));
        let total: f64 = points.iter().map(|(_, weight)| weight).sum();
        let mut shares = [0.25 * EVEN_SHARE; 4];
        for inner in points.chunk_by_mut(|a, b| quarter(a.0) == quarter(b.0)) {
            let at = quarter(inner[0].0);
            shares[at] += (1.0 - EVEN_SHARE) * inner.iter().map(|(_, weight)| weight).sum::<f64>() / total;
            if inner.len() > MOST && depth < DEEPEST {
                let corner = corner + DVec2::new((at % 2) as f64, (at / 2) as f64) * half;
                self.0[number].inner[at] = self.divide(inner, corner, half, depth + 1);
            }
        }
        let [a, b, c, d] = shares;
        self.0[number].lower = ((a + b) / ((a + b) + (c + d))) as f32;
        self.0[number].left = [a / (a + b), c / (c + d)].map(|left| left as f32);
        number as u32
    }

    /// A point for `u` in [0, 1)^2, and its density.
    #[inline]
    pub fn sample(&self, first: u32, mut u: DVec2) -> (DVec2, f64) {
        let (mut corner, mut size, mut density, mut at) = (DVec2::ZERO, 1.0, 1.0, first as usize);
        loop {
            let Square { lower, left, inner } = &self.0[at];
            let (y, row, of_row) = choose(u.y, f64::from(*lower));
            let (x, column, of_column) = choose(u.x, f64::from(left[row]));
            u = DVec2::new(x, y);
            size *= 0.5;
            corner += DVec2::new(column as f64, row as f64) * size;
            density *= 4.0 * of_row * of_column;
            at = inner[row * 2 + column] as usize;
            if at == 0 {
                return (corner + u * size, density);
            }
        }
    }

    /// The density with which [`Self::sample`] chooses a point.
    #[inline]
    pub fn pdf(&self, first: u32, mut point: DVec2) -> f64 {
        let (mut density, mut at) = (1.0, first as usize);
        loop {
            let Square { lower, left, inner } = &self.0[at];
            point *= 2.0;
            let [column, row] = [point.x, point.y].map(|along| usize::from(along >= 1.0));
            point -= DVec2::new(column as f64, row as f64);
            let share = |lower: f32, part: usize| if part == 0 { f64::from(lower) } else { 1.0 - f64::from(lower) };
            density *= 4.0 * share(*lower, row) * share(left[row], column);
            let quarter = 2 * row + column;
            at = inner[quarter] as usize;
            if at == 0 {
                return density;
            }
        }
    }
}

/// The lower part of an interval, which is chosen as often as its share says, or the upper one: the number within it, which one, and its share.
#[inline]
fn choose(u: f64, lower: f64) -> (f64, usize, f64) {
    let (within, part, share) = if u < lower { (u / lower, 0, lower) } else { ((u - lower) / (1.0 - lower), 1, 1.0 - lower) };
    (within.min(1.0 - f64::EPSILON), part, share)
}
