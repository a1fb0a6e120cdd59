//! Reading what a script hands to a function of the API: every key is known, every value checked, every fault named.

use mlua::{AnyUserData, Function, Lua, MultiValue, Table, Value};
use tessera_engine::description::{Rgb, Source, SourceId};

use super::{
    context::Context,
    fault::Fault,
    handle::{Handle, Thing},
    place::Place,
};

/// The values given to one call, or to a table within one.
pub struct Keys<'a> {
    pub lua: &'a Lua,
    /// Where the call stands.
    pub place: Place,
    /// What is being made: `sphere`, `sphere "sun"`, `job: film`.
    pub label: String,
    known: &'static [&'static str],
    given: Given,
}

enum Given {
    Table(Table),
    List(MultiValue),
}

/// Longest text of a script that a message repeats.
const QUOTED: usize = 60;

/// Lists within lists of objects.
const NESTED_LISTS: usize = 8;

impl<'a> Keys<'a> {
    /// The keys of a call with one table: `tessera.sphere { radius = 1 }`. `items` tells whether the table may hold a list too.
    pub fn of_table(lua: &'a Lua, label: &str, known: &'static [&'static str], items: bool, arguments: MultiValue) -> mlua::Result<Self> {
        let place = Place::of_running(lua);
        let table = match (arguments.len(), arguments.into_iter().next()) {
            (0, _) | (1, Some(Value::Nil)) => lua.create_table()?,
            (1, Some(Value::Table(table))) => table,
            (1, Some(other)) => {
                let got = describe(lua, &other);
                return Err(place.fault(format!("{label}: expected a table of keys, got {got}")).with_help(usage(label, known)).into());
            }
            _ => return Err(place.fault(format!("{label}: expected one table of keys")).with_help(usage(label, known)).into()),
        };
        let label = label_of(label, known, &table)?;
        let keys = Self { lua, place, label, known, given: Given::Table(table) };
        keys.check_known(items)?;
        if known.contains(&"name") {
            keys.optional("name")?.map(|name| name.text()).transpose()?;
        }
        Ok(keys)
    }

    /// The arguments of a call by position: `tessera.rgb(1, 0.5, 0)`.
    pub fn of_list(lua: &'a Lua, label: &str, known: &'static [&'static str], arguments: MultiValue) -> mlua::Result<Self> {
        let keys = Self { lua, place: Place::of_running(lua), label: label.to_owned(), known, given: Given::List(arguments) };
        match &keys.given {
            Given::List(list) if list.len() > known.len() => {
                Err(keys.fault(format!("takes {}, got {} values", signature(known), list.len())).into())
            }
            _ => Ok(keys),
        }
    }

    fn check_known(&self, items: bool) -> mlua::Result<()> {
        let Given::Table(table) = &self.given else { return Ok(()) };
        table.for_each(|key: Value, _: Value| match &key {
            Value::String(name) if self.known.iter().any(|known| known.as_bytes() == &*name.as_bytes()) => Ok(()),
            Value::String(name) => {
                let name = name.to_string_lossy();
                let help = nearest(&name, self.known.iter().copied()).map_or_else(
                    || self.elsewhere(&name).unwrap_or_else(|| usage("it", self.known)),
                    |near| format!("did you mean `{near}`?"),
                );
                Err(self.fault(format!("unknown key `{}`", shorten(&name))).with_help(help).into())
            }
            Value::Integer(_) | Value::Number(_) if items => Ok(()),
            Value::Integer(_) | Value::Number(_) => Err(self.fault("a value without a key").with_help(usage("it", self.known)).into()),
            other => Err(self.fault(format!("{} cannot be a key", describe(self.lua, other))).into()),
        })
    }

    /// Where something is said that other programs call so.
    fn elsewhere(&self, name: &str) -> Option<String> {
        let (_, key, example) = ELSEWHERE.iter().find(|(other, key, _)| *other == name && self.known.contains(key))?;
        Some(format!("say it by `{key}`: {example}"))
    }

    /// A fault of this call.
    pub fn fault(&self, what: impl std::fmt::Display) -> Fault {
        self.place.fault(format!("{}: {what}", self.label))
    }

    /// The value of a key, or `None`.
    pub fn optional(&self, key: &'static str) -> mlua::Result<Option<Field<'_, 'a>>> {
        debug_assert!(self.known.contains(&key), "{key} is read but not known");
        let value = match &self.given {
            Given::Table(table) => table.raw_get::<Value>(key)?,
            Given::List(list) => self.known.iter().position(|known| *known == key).and_then(|at| list.get(at).cloned()).unwrap_or_default(),
        };
        Ok((!value.is_nil()).then(|| Field { keys: self, name: key.to_owned(), value }))
    }

    /// The value of a key that must be there.
    pub fn required(&self, key: &'static str) -> mlua::Result<Field<'_, 'a>> {
        self.optional(key)?.ok_or_else(|| self.fault(format!("`{key}` is missing")).with_help(usage("it", self.known)).into())
    }

    /// The value of a key as `read` takes it, or its default.
    pub fn or<T>(&self, key: &'static str, default: T, read: impl FnOnce(Field<'_, 'a>) -> mlua::Result<T>) -> mlua::Result<T> {
        self.optional(key)?.map_or(Ok(default), read)
    }

    /// The list part of the table.
    pub fn items(&self) -> mlua::Result<Vec<Field<'_, 'a>>> {
        match &self.given {
            Given::Table(table) => items(self, "", table, true),
            Given::List(_) => Ok(Vec::new()),
        }
    }

    /// Makes a handle of what was read.
    pub fn make(&self, make: impl FnOnce(SourceId) -> Thing) -> mlua::Result<Value> {
        let source = Source { file: self.place.file.clone(), line: self.place.line, object: self.label.clone() };
        let id = Context::of(self.lua)?.made(source)?;
        self.lua.create_userdata(Handle { thing: make(id), source: id }).map(Value::UserData)
    }
}

/// One value with its name.
pub struct Field<'k, 'a> {
    pub keys: &'k Keys<'a>,
    pub name: String,
    pub value: Value,
}

/// Bounds of a number.
#[derive(Clone, Copy)]
pub struct Range {
    pub lowest: f64,
    pub highest: f64,
    /// Whether the bounds themselves are outside.
    pub open: bool,
    /// For messages: `a number above 0`.
    pub words: &'static str,
}

/// Any finite number.
pub const FINITE: Range = Range { lowest: f64::MIN, highest: f64::MAX, open: false, words: "a finite number" };
/// Above 0.
pub const POSITIVE: Range = Range { lowest: 0.0, highest: f64::INFINITY, open: true, words: "a number above 0" };
/// From 0 to 1.
pub const UNIT: Range = Range { lowest: 0.0, highest: 1.0, open: false, words: "a number from 0 to 1" };

impl<'a> Field<'_, 'a> {
    /// What was expected, and what came instead.
    pub fn wrong(&self, expected: impl std::fmt::Display) -> Fault {
        self.keys.fault(format!("`{}` must be {expected}, got {}", self.name, describe(self.keys.lua, &self.value)))
    }

    /// A fault of this value in other words.
    pub fn fault(&self, what: impl std::fmt::Display) -> Fault {
        self.keys.fault(format!("`{}` {what}", self.name))
    }

    fn child(&self, name: String, value: Value) -> Self {
        Self { keys: self.keys, name, value }
    }

    pub fn number(&self, range: Range) -> mlua::Result<f64> {
        let number = match &self.value {
            Value::Number(number) => *number,
            Value::Integer(number) => *number as f64,
            _ => return Err(self.wrong(range.words).into()),
        };
        let inside =
            if range.open { number > range.lowest && number < range.highest } else { number >= range.lowest && number <= range.highest };
        if number.is_finite() && inside {
            return Ok(number);
        }
        let unsaid = number > range.highest && range.highest < f64::MAX && range.words.ends_with(" up");
        Err(self.wrong(if unsaid { format!("{}, {:e} at the most", range.words, range.highest) } else { range.words.to_owned() }).into())
    }

    pub fn integer(&self, lowest: u64, highest: u64) -> mlua::Result<u64> {
        let number = match &self.value {
            Value::Number(number) if number.fract() == 0.0 && *number >= 0.0 && *number < 9e15 => Some(*number as u64),
            Value::Integer(number) => u64::try_from(*number).ok(),
            _ => None,
        };
        let expected = || {
            if highest >= 1 << 53 {
                format!("a whole number from {lowest} up")
            } else {
                format!("a whole number from {lowest} to {highest}")
            }
        };
        number.filter(|number| (lowest..=highest).contains(number)).ok_or_else(|| self.wrong(expected()).into())
    }

    /// An integer that fits 32 bits.
    pub fn integer32(&self, lowest: u32, highest: u32) -> mlua::Result<u32> {
        self.integer(lowest.into(), highest.into()).map(|number| u32::try_from(number).unwrap_or(highest))
    }

    pub fn boolean(&self) -> mlua::Result<bool> {
        self.value.as_boolean().ok_or_else(|| self.wrong("true or false").into())
    }

    pub fn text(&self) -> mlua::Result<String> {
        let text = self.value.as_string().and_then(|text| text.to_str().ok().map(|text| text.to_owned()));
        text.ok_or_else(|| self.wrong("a text").into())
    }

    /// One of several words.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> mlua::Result<T> {
        let words = || quoted(choices);
        let Some(text) = self.value.as_string().map(|text| text.to_string_lossy()) else { return Err(self.wrong(words()).into()) };
        let help = || nearest(&text, choices.iter().map(|(word, _)| *word)).map(|near| format!("did you mean \"{near}\"?"));
        choices.iter().find(|(word, _)| *word == text).map(|(_, choice)| *choice).ok_or_else(|| {
            let fault = self.wrong(words());
            match help() {
                Some(help) => fault.with_help(help).into(),
                None => fault.into(),
            }
        })
    }

    /// A list of such words.
    pub fn choices<T: Copy>(&self, choices: &[(&str, T)]) -> mlua::Result<Vec<T>> {
        match &self.value {
            Value::Table(table) if !has_keys(table)? => self.list()?.iter().map(|word| word.choice(choices)).collect(),
            _ => Err(self.wrong(format!("a list of {}", quoted(choices))).into()),
        }
    }

    /// A list of exactly `N` numbers: `{1, 2, 3}` or, for three, a Luau vector.
    pub fn numbers<const N: usize>(&self, range: Range) -> mlua::Result<[f64; N]> {
        let words = || format!("{}, each {}", self.shape::<N>(), range.words);
        let mut numbers = [0.0; N];
        match &self.value {
            Value::Vector(vector) if N == 3 => {
                for (axis, component) in [vector.x(), vector.y(), vector.z()].into_iter().enumerate() {
                    let component = Value::Number(component.into());
                    numbers[axis] = self.child(format!("{}[{}]", self.name, axis + 1), component).number(range)?;
                }
            }
            Value::Table(table) if table.raw_len() == N && !has_keys(table)? => {
                for (index, number) in numbers.iter_mut().enumerate() {
                    *number = self.child(format!("{}[{}]", self.name, index + 1), table.raw_get(index + 1)?).number(range)?;
                }
            }
            _ => return Err(self.wrong(words()).into()),
        }
        Ok(numbers)
    }

    fn shape<const N: usize>(&self) -> &'static str {
        match N {
            2 => "two numbers {u, v}",
            3 => "three numbers {x, y, z}",
            4 => "four numbers",
            _ => "a list of numbers",
        }
    }

    /// Three finite numbers.
    pub fn vec3(&self) -> mlua::Result<[f64; 3]> {
        self.numbers(FINITE)
    }

    /// Three finite numbers, not all 0.
    pub fn direction(&self) -> mlua::Result<[f64; 3]> {
        let direction = self.vec3()?;
        if direction.iter().any(|component| *component != 0.0) {
            Ok(direction)
        } else {
            Err(self.fault("must have a length: it is {0, 0, 0}").into())
        }
    }

    /// A linear colour: `{r, g, b}` or one number for grey; no component below 0, nor above `highest`.
    pub fn color(&self, highest: f64) -> mlua::Result<Rgb> {
        let range = if highest <= 1.0 { UNIT } else { Range { lowest: 0.0, highest, open: false, words: "a number from 0 up" } };
        let [r, g, b] = match &self.value {
            Value::Number(_) | Value::Integer(_) => [self.number(range)?; 3],
            Value::Table(_) | Value::Vector(_) => self.numbers::<3>(range).map_err(|error| self.color_help(error))?,
            _ => {
                return Err(self
                    .wrong("a colour {r, g, b} or a grey number")
                    .with_help("tessera.hex(\"#ff8800\") and tessera.srgb(r, g, b) make colours")
                    .into());
            }
        };
        Ok([r as f32, g as f32, b as f32])
    }

    fn color_help(&self, error: mlua::Error) -> mlua::Error {
        let fault = Fault::from(&error);
        if fault.help.is_some() {
            error
        } else {
            fault.with_help("a colour is {r, g, b}, linear; see tessera.srgb and tessera.hex for others").into()
        }
    }

    /// A table of further keys: `film = { width = 8 }`.
    pub fn table(&self, known: &'static [&'static str]) -> mlua::Result<Keys<'a>> {
        let Value::Table(table) = &self.value else { return Err(self.wrong("a table of keys").with_help(usage(&self.name, known)).into()) };
        let label = format!("{}: {}", self.keys.label, self.name);
        let keys = Keys { lua: self.keys.lua, place: self.keys.place.clone(), label, known, given: Given::Table(table.clone()) };
        keys.check_known(false)?;
        Ok(keys)
    }

    /// The values of a list, lists within it in their place.
    pub fn list(&self) -> mlua::Result<Vec<Self>> {
        let Value::Table(table) = &self.value else { return Err(self.wrong("a list").into()) };
        items(self.keys, &self.name, table, false)
    }

    pub fn function(&self) -> Option<&Function> {
        self.value.as_function()
    }

    /// A thing that the API made, if `take` wants it.
    pub fn thing<T>(&self, expected: &str, take: impl FnOnce(&Handle) -> Option<T>) -> mlua::Result<T> {
        let taken = self.value.as_userdata().and_then(|data| data.borrow::<Handle>().ok().and_then(|handle| take(&handle)));
        taken.ok_or_else(|| {
            let fault = self.wrong(expected);
            if self.value.is_function() {
                fault.with_help("call it: constructors take a table of keys, such as tessera.whitted {}").into()
            } else {
                fault.into()
            }
        })
    }
}

/// What other programs have words for, the key that says it here, and how.
const ELSEWHERE: &[(&str, &str, &str)] = &[
    ("samples", "quality", "quality = { samples = 16 }"),
    ("spp", "quality", "quality = { samples = 16 }"),
    ("width", "film", "film = { width = 640, height = 480 }"),
    ("height", "film", "film = { width = 640, height = 480 }"),
    ("resolution", "film", "film = { width = 640, height = 480 }"),
    ("integrator", "render", "render = tessera.path {}"),
    ("objects", "scene", "scene = tessera.scene { objects = { ... } }"),
    ("lights", "scene", "scene = tessera.scene { objects = { ... }, lights = { ... } }"),
    ("aovs", "output", "output = { aovs = { \"albedo\" } }"),
    ("color", "reflectance", "reflectance = { 0.8, 0.5, 0.2 }"),
    ("colour", "reflectance", "reflectance = { 0.8, 0.5, 0.2 }"),
    ("albedo", "reflectance", "reflectance = { 0.8, 0.5, 0.2 }"),
    ("color", "radiance", "radiance = { 5, 4, 3 }"),
    ("strength", "radiance", "radiance = { 5, 4, 3 }"),
    ("power", "intensity", "intensity = { 5, 4, 3 }"),
];

fn quoted<T>(choices: &[(&str, T)]) -> String {
    choices.iter().map(|(word, _)| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ")
}

/// `sphere "sun"`: with the object's name, or that of its file.
fn label_of(label: &str, known: &[&str], table: &Table) -> mlua::Result<String> {
    let text = |key: &str| Ok::<_, mlua::Error>(table.raw_get::<Value>(key)?.as_string().map(|text| text.to_string_lossy()));
    let file = || if known.contains(&"file") { text("file") } else { Ok(None) };
    let name = match text("name")? {
        Some(name) => Some(name),
        None => file()?.map(|file| file.rsplit('/').next().unwrap_or_default().to_owned()),
    };
    Ok(name.map_or(label.to_owned(), |name| format!("{label} \"{}\"", shorten(&name))))
}

fn has_keys(table: &Table) -> mlua::Result<bool> {
    let length = table.raw_len();
    let mut pairs = 0;
    table.for_each(|_: Value, _: Value| {
        pairs += 1;
        Ok(())
    })?;
    Ok(pairs != length)
}

fn items<'k, 'a>(keys: &'k Keys<'a>, name: &str, table: &Table, beside_keys: bool) -> mlua::Result<Vec<Field<'k, 'a>>> {
    let mut fields = Vec::new();
    check_list(keys, name, table, beside_keys)?;
    gather(keys, name, table, NESTED_LISTS, &mut fields)?;
    Ok(fields)
}

fn gather<'k, 'a>(keys: &'k Keys<'a>, name: &str, table: &Table, depth: usize, fields: &mut Vec<Field<'k, 'a>>) -> mlua::Result<()> {
    for index in 1..=table.raw_len() {
        let name = format!("{name}[{index}]");
        match table.raw_get::<Value>(index)? {
            Value::Table(_) if depth == 0 => return Err(keys.fault(format!("`{name}`: lists within lists go too deep")).into()),
            Value::Table(inner) => {
                check_list(keys, &name, &inner, false)?;
                gather(keys, &name, &inner, depth - 1, fields)?;
            }
            value => fields.push(Field { keys, name, value }),
        }
    }
    Ok(())
}

/// Refuses what a list would lose: what stands under a name (where names were not checked before), below 1, or beyond a gap.
fn check_list(keys: &Keys, name: &str, table: &Table, beside_keys: bool) -> mlua::Result<()> {
    let length = table.raw_len();
    let whose = if name.is_empty() { "the list".to_owned() } else { format!("`{name}`") };
    table.for_each(|key: Value, _: Value| {
        let number = match &key {
            Value::Integer(number) => *number as f64,
            Value::Number(number) => *number,
            Value::String(_) if beside_keys => return Ok(()),
            other => {
                let fault = keys.fault(format!("{whose} must be a list, but has a value with the key {}", describe(keys.lua, other)));
                return Err(fault.with_help("leave the key out: `{ a, b }`; what is in it may have a `name` of its own").into());
            }
        };
        if (1.0..=length as f64).contains(&number) && number.fract() == 0.0 {
            return Ok(());
        }
        let end = if length == 0 { "has none at 1".to_owned() } else { format!("ends at {length}") };
        let fault = keys.fault(format!("{whose} has a value at {number}, but {end}"));
        Err(fault.with_help("lists count from 1 and have no gaps: table.insert keeps them whole").into())
    })
}

/// A value in words.
pub fn describe(lua: &Lua, value: &Value) -> String {
    match value {
        Value::Nil => "nothing".to_owned(),
        Value::Boolean(value) => value.to_string(),
        Value::Integer(number) => number.to_string(),
        Value::Number(number) if number.is_nan() => "nan (not a number)".to_owned(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => format!("the text \"{}\"", shorten(&text.to_string_lossy())),
        Value::Table(table) => describe_table(table),
        Value::UserData(data) => describe_handle(lua, data),
        other => format!("a {}", other.type_name()),
    }
}

fn describe_table(table: &Table) -> String {
    match (table.raw_len(), has_keys(table).unwrap_or(true)) {
        (0, false) => "an empty table".to_owned(),
        (0, true) => "a table with keys".to_owned(),
        (1, false) => "a list of 1 value".to_owned(),
        (length, false) => format!("a list of {length} values"),
        (_, true) => "a list with keys".to_owned(),
    }
}

fn describe_handle(lua: &Lua, data: &AnyUserData) -> String {
    let source = data.borrow::<Handle>().ok().map(|handle| handle.source);
    let context = Context::of(lua).ok();
    match source.and_then(|source| context.as_ref()?.sources.get(source).cloned()) {
        Some(Source { file, object, .. }) if file.is_empty() => with_article(&object),
        Some(Source { file, line, object }) => format!("{} (made at {file}:{line})", with_article(&object)),
        None => "an object of another kind".to_owned(),
    }
}

fn with_article(object: &str) -> String {
    let article = if object.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {object}")
}

fn shorten(text: &str) -> String {
    let plain: String = text.chars().take(QUOTED).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().count() > QUOTED { format!("{plain}...") } else { plain }
}

/// The name that was probably meant.
pub fn nearest<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let distance = |known: &str| strsim::damerau_levenshtein(&name.to_lowercase(), known);
    known.map(|known| (distance(known), known)).min().filter(|(distance, known)| *distance <= 1 + known.len() / 3).map(|(_, known)| known)
}

fn usage(whose: &str, known: &[&str]) -> String {
    if known.is_empty() { format!("{whose} takes no keys") } else { format!("{whose} takes {}", list_words(known)) }
}

fn list_words(words: &[&str]) -> String {
    words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}

fn signature(known: &[&str]) -> String {
    if known.is_empty() { "no values".to_owned() } else { format!("({})", known.join(", ")) }
}
