//! Frames of a sequence: the scene and the camera as functions of the frame's number.

use mlua::Value;

use crate::{
    job::{
        Frames, Output,
        context::Context,
        keys::{Field, Keys},
    },
    limits::FRAMES_PER_SEQUENCE,
};

pub const FRAMES: &[&str] = &["first", "last", "step", "in_order"];

/// The parameter that chooses one frame: `--set frame=12`.
pub const PARAMETER: &str = "frame";

const LAST: u32 = 9_999_999;

/// A sequence, and which frame of it this run of the script is for: the one that was chosen, or else the first.
pub fn frames(job: &Keys) -> mlua::Result<Option<(u32, Frames)>> {
    let Some(field) = job.optional("frames")? else { return Ok(None) };
    let frames = read(&field)?;
    let given = {
        let mut context = Context::of(job.lua)?;
        context.declared.push(PARAMETER.to_owned());
        context.given.get(PARAMETER).cloned()
    };
    let Some(given) = given else { return Ok(Some((frames.first, frames))) };
    let frame = given.parse().ok().filter(|frame| frames.numbers().any(|number| number == *frame));
    let wrong = || job.fault(format!("--set {PARAMETER}={given}: it is no frame of {frames}"));
    frame.map(|frame| Some((frame, frames))).ok_or_else(|| wrong().into())
}

/// `{ 1, 240 }`, or a table of keys.
fn read(field: &Field) -> mlua::Result<Frames> {
    let short = field.value.as_table().is_some_and(|table| table.raw_len() == 2);
    let frames = if short {
        let items = field.list()?;
        let [first, last] = &items[..] else { return Err(field.wrong("two numbers {first, last}").into()) };
        Frames { first: first.integer32(0, LAST)?, last: last.integer32(0, LAST)?, step: 1, in_order: false }
    } else {
        let keys = field.table(FRAMES)?;
        Frames {
            first: keys.required("first")?.integer32(0, LAST)?,
            last: keys.required("last")?.integer32(0, LAST)?,
            step: keys.or("step", 1, |field| field.integer32(1, LAST))?,
            in_order: keys.or("in_order", false, |field| field.boolean())?,
        }
    };
    if frames.last < frames.first {
        let fault = field.fault(format!("ends with frame {} before its first, {}", frames.last, frames.first));
        return Err(fault.with_help("write it as {first, last}").into());
    }
    let count = frames.numbers().count();
    if count > FRAMES_PER_SEQUENCE {
        return Err(field.fault(format!("are {count} frames; {FRAMES_PER_SEQUENCE} are the most")).into());
    }
    Ok(frames)
}

/// A value that may be a function of the frame's number.
pub fn of_frame<'k, 'a>(mut field: Field<'k, 'a>, frames: Option<&(u32, Frames)>) -> mlua::Result<Field<'k, 'a>> {
    if field.function().is_some() && frames.is_none() {
        let fault = field.fault("is a function of the frame's number, and the job has no frames");
        return Err(fault.with_help("give the job `frames = { 1, 240 }`, or call the function").into());
    }
    if let (Some(function), Some((frame, _))) = (field.function(), frames) {
        field.value = function.call::<Value>(*frame)?;
        if field.value.is_nil() {
            return Err(field.fault(format!("is a function that returns nothing for frame {frame}")).into());
        }
    }
    Ok(field)
}

impl Output {
    /// The files of one frame of a sequence.
    pub(super) fn numbered(self, frames: Option<&(u32, Frames)>) -> Self {
        let exr = numbered(&self.exr, ".exr", frames);
        let png = self.png.as_deref().map(|png| numbered(png, ".png", frames));
        Self { exr, png, ..self }
    }
}

/// A file's name with the frame's number before its ending, in four digits or more, so that a sequence sorts.
pub fn numbered(name: &str, ending: &str, frames: Option<&(u32, Frames)>) -> String {
    match (frames, name.strip_suffix(ending)) {
        (Some((frame, _)), Some(stem)) => format!("{stem}.{frame:04}{ending}"),
        _ => name.to_owned(),
    }
}
