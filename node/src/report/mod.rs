//! What came of a job, for people: the text at the end of a render, the paper's table over several runs, an HTML page, and
//! error against time.

mod style;
pub mod svg;
mod text;
mod table;
mod timeline;
mod costs;
mod html;
mod difference;
mod tradeoff;

pub use difference::{Difference, difference};
pub use html::html;
pub use style::{Style, seconds, table as lined_up};
pub use table::{Run, notes, runs, table};
pub use text::text;
pub use tradeoff::{Rung, Tradeoff, ladder};

#[cfg(test)]
mod tests;
