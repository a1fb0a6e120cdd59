//! What the functions of the API return: opaque handles of plain values.

use std::sync::Arc;

use glam::DAffine3;
use mlua::{Function, Lua, MetaMethod, UserData, UserDataMethods, Value};
use tessera_engine::description::{
    Aovs, Camera, Environment, Film, Light, Material, Matrix, Medium, Model, Quality, Render, Shape, SourceId, Texture,
};

use super::{Frames, Output, api::transform, keys::describe, place::Place};
use crate::schedule::{Assign, Probe, Split};

/// An object as a script holds it.
pub struct Handle {
    pub thing: Thing,
    pub source: SourceId,
}

/// All kinds of things that the API makes.
#[derive(Clone)]
pub enum Thing {
    Object(Arc<ObjectNode>),
    Group(Arc<GroupNode>),
    Material(Arc<MaterialNode>),
    Texture(Texture),
    Light(Light),
    Medium(Medium),
    Environment(Environment),
    Camera(Camera),
    Render(Render),
    Probe(Probe),
    Split(Split),
    Assign(Assign),
    Transform(DAffine3),
    Scene(Arc<SceneNode>),
    Job(Arc<JobNode>),
}

/// One object of a scene or group.
pub struct ObjectNode {
    pub kind: NodeKind,
    pub transform: Option<Matrix>,
    pub source: SourceId,
}

/// What an object is.
pub enum NodeKind {
    Shape { shape: Shape, material: Arc<MaterialNode> },
    Model { model: Model, material: Option<Arc<MaterialNode>> },
    Instance { group: Arc<GroupNode> },
}

/// Objects that are placed together.
pub struct GroupNode {
    pub objects: Vec<Arc<ObjectNode>>,
    /// Groups within this group, one within the other.
    pub depth: u32,
}

/// A material with its textures, which it names by their place here.
pub struct MaterialNode {
    pub material: Material,
    pub textures: Vec<Texture>,
}

/// All that is there.
pub struct SceneNode {
    pub objects: Vec<Arc<ObjectNode>>,
    pub lights: Vec<Light>,
    pub background: Environment,
    pub medium: Option<Medium>,
}

/// What `tessera.job` was given.
pub struct JobNode {
    pub scene: Arc<SceneNode>,
    pub camera: Option<Camera>,
    pub film: Film,
    pub render: Render,
    pub quality: Quality,
    pub probe: Probe,
    pub split: Policy<Split>,
    pub assign: Policy<Assign>,
    pub output: Output,
    pub aovs: Aovs,
    pub seed: u64,
    pub audit: f64,
    pub attempts: u32,
    pub patience: Option<f64>,
    /// Which frame of how many it is, where there are several.
    pub frames: Option<(u32, Frames)>,
}

/// A built-in policy, or the script's own function.
#[derive(Clone)]
pub enum Policy<T> {
    BuiltIn(T),
    Script(Function),
}

impl UserData for Handle {
    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_function(MetaMethod::Mul, |lua, (left, right): (Value, Value)| transform::compose(lua, &left, &right));
        methods.add_meta_function(MetaMethod::ToString, |lua, value: Value| Ok(describe(lua, &value)));
        methods.add_meta_function(MetaMethod::Index, |lua, (value, _): (Value, Value)| opaque(lua, &value, "read"));
        methods.add_meta_function(MetaMethod::NewIndex, |lua, (value, _, _): (Value, Value, Value)| opaque(lua, &value, "changed"));
    }
}

fn opaque(lua: &Lua, value: &Value, verb: &str) -> mlua::Result<()> {
    let what = describe(lua, value);
    Err(Place::of_running(lua)
        .fault(format!("the keys of {what} cannot be {verb}"))
        .with_help("keep what you need in a variable or table of your own before making the object")
        .into())
}

impl ObjectNode {
    /// Groups within this object.
    pub fn depth(&self) -> u32 {
        match &self.kind {
            NodeKind::Instance { group } => group.depth,
            _ => 0,
        }
    }
}
