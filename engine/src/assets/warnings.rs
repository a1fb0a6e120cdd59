//! What a file asks for that is not modelled, said once however often it is asked for.

/// Names of objects that one warning lists.
const MAX_NAMES: usize = 4;

/// Warnings in the order in which they first came up.
#[derive(Default)]
pub(crate) struct Warnings {
    entries: Vec<Entry>,
}

struct Entry {
    /// What the named objects are: `material`. Empty for a warning about the whole file.
    kind: &'static str,
    text: String,
    names: Vec<String>,
    more: usize,
}

impl Warnings {
    /// Warns of the whole file.
    pub fn file(&mut self, text: impl Into<String>) {
        self.object("", String::new(), text);
    }

    /// Says how many triangles of the whole file were left out, if any, because they name a vertex twice.
    pub fn flat_triangles(&mut self, count: usize) {
        if count > 0 {
            self.file(format!("triangles that name a vertex twice have no area; left out ({count})"));
        }
    }

    /// Warns of one object of the file. The same text for several objects becomes one warning.
    pub fn object(&mut self, kind: &'static str, name: impl Into<String>, text: impl Into<String>) {
        let (name, text) = (name.into(), text.into());
        match self.entries.iter_mut().find(|entry| entry.kind == kind && entry.text == text) {
            None => self.entries.push(Entry { kind, text, names: vec![name], more: 0 }),
            Some(entry) if entry.names.contains(&name) => {}
            Some(entry) if entry.names.len() < MAX_NAMES => entry.names.push(name),
            Some(entry) => entry.more += 1,
        }
    }

    /// `material "glass": text`, or `materials "glass", "water" and 3 more: text`.
    pub fn into_texts(self) -> Vec<String> {
        self.entries.into_iter().map(Entry::into_text).collect()
    }
}

impl Entry {
    fn into_text(self) -> String {
        let Self { kind, text, names, more } = self;
        let list = names.join(", ");
        match (kind, names.len(), more) {
            ("", ..) => text,
            (_, 1, 0) => format!("{kind} {list}: {text}"),
            (_, _, 0) => format!("{kind}s {list}: {text}"),
            _ => format!("{kind}s {list} and {more} more: {text}"),
        }
    }
}
