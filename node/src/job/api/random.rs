//! Seeded random numbers: the same seed gives the same numbers on every machine.

use mlua::{Lua, MetaMethod, MultiValue, UserData, UserDataMethods, Value};
use tessera_engine::math;

use super::{Form, Function};
use crate::job::keys::{FINITE, Keys, POSITIVE, Range};

pub const FUNCTIONS: &[Function] = &[Function { path: "random", form: Form::Positional, keys: &["seed"], make: random }];

/// A method of a generator.
pub struct Method {
    /// Its name.
    pub name: &'static str,
    /// Its parameters in order.
    pub parameters: &'static [&'static str],
    call: fn(&mut Generator, &Keys) -> mlua::Result<Value>,
}

/// All methods of a generator.
pub const METHODS: &[Method] = &[
    Method { name: "uniform", parameters: &["lowest", "highest"], call: uniform },
    Method { name: "integer", parameters: &["lowest", "highest"], call: integer },
    Method { name: "normal", parameters: &["mean", "deviation"], call: normal },
    Method { name: "in_sphere", parameters: &["radius"], call: in_sphere },
    Method { name: "on_sphere", parameters: &["radius"], call: on_sphere },
    Method { name: "in_disc", parameters: &["radius"], call: in_disc },
    Method { name: "choice", parameters: &["list"], call: choice },
    Method { name: "shuffle", parameters: &["list"], call: shuffle },
];

/// SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
struct Generator {
    state: u64,
}

impl Generator {
    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1), in steps of 2^-53.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 * 2f64.powi(-53)
    }

    /// In [0, count), without bias that could be seen: the range is far below 2^64.
    fn below(&mut self, count: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(count)) >> 64) as u64
    }

    /// In (-1, 1) in each of `N` components, and inside the unit ball.
    fn in_ball<const N: usize>(&mut self) -> [f64; N] {
        loop {
            let point = [(); N].map(|()| 2.0 * self.unit() - 1.0);
            let squared: f64 = point.iter().map(|x| x * x).sum();
            if squared < 1.0 && squared > 0.0 {
                return point;
            }
        }
    }
}

impl UserData for Generator {
    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        for method in METHODS {
            methods.add_method_mut(method.name, |lua: &Lua, generator, arguments: MultiValue| {
                let label = format!("random:{}", method.name);
                (method.call)(generator, &Keys::of_list(lua, &label, method.parameters, arguments)?)
            });
        }
        methods.add_meta_function(MetaMethod::ToString, |_, _: Value| Ok("a random generator"));
    }
}

fn random(keys: &Keys) -> mlua::Result<Value> {
    let seed = keys.or("seed", 0, |field| field.integer(0, 1 << 53))?;
    keys.lua.create_userdata(Generator { state: seed }).map(Value::UserData)
}

fn uniform(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let lowest = keys.or("lowest", 0.0, |field| field.number(FINITE))?;
    let highest = keys.or("highest", 1.0, |field| field.number(FINITE))?;
    Ok(Value::Number(lowest + (highest - lowest) * generator.unit()))
}

fn integer(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    const WHOLE: f64 = 9_007_199_254_740_992.0;
    const RANGE: Range = Range { lowest: -WHOLE, highest: WHOLE, open: false, words: "a whole number" };
    let bound = |key| {
        let field = keys.required(key)?;
        let number = field.number(RANGE)?;
        if number.fract() == 0.0 { Ok(number as i64) } else { Err(mlua::Error::from(field.wrong(RANGE.words))) }
    };
    let (lowest, highest) = (bound("lowest")?, bound("highest")?);
    if lowest > highest {
        return Err(keys.fault("`highest` must not be below `lowest`").into());
    }
    let offset = generator.below((highest - lowest) as u64 + 1);
    Ok(Value::Number((lowest + offset as i64) as f64))
}

/// Marsaglia's polar method (1964).
fn normal(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let mean = keys.or("mean", 0.0, |field| field.number(FINITE))?;
    let deviation = keys.or("deviation", 1.0, |field| field.number(Range { open: false, words: "a number from 0 up", ..POSITIVE }))?;
    let [x, y] = generator.in_ball::<2>();
    let squared = x * x + y * y;
    Ok(Value::Number(mean + deviation * x * (-2.0 * math::ln(squared) / squared).sqrt()))
}

fn in_sphere(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let radius = radius(keys)?;
    let point = generator.in_ball::<3>();
    list(keys, &point.map(|x| radius * x))
}

fn on_sphere(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let radius = radius(keys)?;
    let [x, y, z] = generator.in_ball::<3>();
    let scale = radius / (x * x + y * y + z * z).sqrt();
    list(keys, &[scale * x, scale * y, scale * z])
}

/// `{x, 0, z}`: the floor lies in x and z.
fn in_disc(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let radius = radius(keys)?;
    let [x, z] = generator.in_ball::<2>();
    list(keys, &[radius * x, 0.0, radius * z])
}

fn radius(keys: &Keys) -> mlua::Result<f64> {
    keys.or("radius", 1.0, |field| field.number(POSITIVE))
}

fn list(keys: &Keys, numbers: &[f64]) -> mlua::Result<Value> {
    keys.lua.create_sequence_from(numbers.iter().copied()).map(Value::Table)
}

fn choice(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let field = keys.required("list")?;
    match &field.value {
        Value::Table(table) if table.raw_len() > 0 => table.raw_get(generator.below(table.raw_len() as u64) + 1),
        _ => Err(field.wrong("a list with something in it").into()),
    }
}

/// Returns a shuffled copy (Fisher and Yates; Durstenfeld, 1964).
fn shuffle(generator: &mut Generator, keys: &Keys) -> mlua::Result<Value> {
    let field = keys.required("list")?;
    let Value::Table(table) = &field.value else { return Err(field.wrong("a list").into()) };
    let mut values: Vec<Value> = (1..=table.raw_len()).map(|at| table.raw_get(at)).collect::<mlua::Result<_>>()?;
    for last in (1..values.len()).rev() {
        values.swap(last, generator.below(last as u64 + 1) as usize);
    }
    keys.lua.create_sequence_from(values).map(Value::Table)
}
