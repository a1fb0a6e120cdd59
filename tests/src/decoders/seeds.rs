//! Seeds in codings of our own: one of every message, so that fuzzing begins with what is whole. Seeds that are text, or that others define, are
//! files and nothing else.

use std::{collections::BTreeMap, fs, time::Duration};

use serde::Serialize;
use tessera_engine::{
    description::{
        Aov, Aovs, AssetId, Camera, ColorSpace, Environment, Falloff, Film, Filter, Frame, FrameHash, Group, Light, Material, MeshData,
        MetallicRoughness, Object, ObjectKind, Quality, Render, Scene, Shape, SourceId, Texture, TextureFilter, Wrap,
    },
    film,
    output::exr,
    part::{Counters, Rect, RenderedPart, SampleRange},
};
use tessera_node::{
    farm::{Answer, Build, Event, Incarnation, JobId, LeaseId, NodeInfo, NodeState, PolicyId},
    job::{JobDescription, Output, PixelType, ScriptBundle},
    journal::Segment,
    schedule::{Assign, CostMap, NodeId, PartId, Probe, Split},
    wire::{
        self, FileHeader, FromNode, Heartbeat, Hello, JobState, JobStatus, JoinRequest, JoinResponse, KeptJob, NewKey, NodeStatus,
        NodeStream, PartHeader, Place, Request, Response, Status, Terms, ToNode,
        tls::{Authority, Role},
    },
};

use super::{
    journal,
    model::PNG,
    scene::{OBJ, model, triangle},
};

/// A seed: its target, its name, its bytes.
pub type Seed = (&'static str, String, Vec<u8>);

const JOB: JobId = JobId(3);
const LEASE: LeaseId = LeaseId(400);
const NODE: NodeId = NodeId(1);
const LIFE: Incarnation = Incarnation(77);
const BUILD: Build = Build { revision: 1, canary: [9; 32] };
const RECT: Rect = Rect { x: 32, y: 0, width: 32, height: 16 };

/// All seeds that follow from the program: another coding makes others.
pub fn made() -> Vec<Seed> {
    let mut seeds = Vec::new();
    node_says(&mut seeds);
    coordinator_says(&mut seeds);
    clients_say(&mut seeds);
    seeds.push(("frame", "shapes".into(), coded(&frame())));
    seeds.push(("frame", "s1".into(), coded(&small(crate::s1::frame(16, 12)))));
    seeds.push(("mesh", "triangle".into(), triangle()));
    seeds.push(("mesh", "square".into(), coded(&square())));
    seeds.push(("journal_segment", "two".into(), segment()));
    seeds.push(("journal_events", "job".into(), events(&[])));
    seeds.push(("journal_events", "troubles".into(), events(&troubles())));
    for (name, pixel_type) in [("float", exr::PixelType::Float), ("half", exr::PixelType::Half)] {
        seeds.push(("exr", name.into(), picture(pixel_type, Aovs::NONE)));
    }
    seeds.push(("exr", "aovs".into(), picture(exr::PixelType::Half, [Aov::Depth, Aov::Object].into_iter().collect())));
    seeds
}

/// Seeds that are different whenever they are made: made where they are missing.
pub fn made_once() -> Vec<Seed> {
    let farm = Authority::new().unwrap();
    let identity = farm.issue(Role::Node, "attic").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = identity.save(folder.path()).unwrap();
    let (_, token) = farm.make_token(Role::Node, Some("attic".into()), 3, Duration::from_secs(1)).unwrap();
    vec![
        ("identity", "node".into(), fs::read(file).unwrap()),
        ("certificate", "request".into(), NewKey::make().unwrap().request().unwrap()),
        ("token", "node".into(), token.into_bytes()),
    ]
}

/// A seed that is there already.
fn seed(name: &str) -> Vec<u8> {
    fs::read(format!("{}/fuzz/seeds/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap_or_default()
}

fn text(name: &str) -> String {
    String::from_utf8(seed(name)).unwrap()
}

fn coded(value: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(value).unwrap()
}

/// Each of these values as a seed of its own.
fn each<T: Serialize>(seeds: &mut Vec<Seed>, target: &'static str, kind: &str, values: &[T]) {
    seeds.extend(values.iter().zip(1..).map(|(value, number): (_, u32)| (target, format!("{kind}-{number}"), coded(value))));
}

fn hello() -> Hello {
    Hello { incarnation: LIFE, lanes: 8, build: "0.1.0".into(), revision: 1 }
}

fn node_says(seeds: &mut Vec<Seed>) {
    let streams = [NodeStream::Control(hello()), NodeStream::Asset(AssetId::of(OBJ))];
    let frames: Vec<u8> = streams.iter().flat_map(|stream| wire::encode(stream, 4096).unwrap()).collect();
    seeds.push(("wire_frame", "two".into(), frames));
    each(seeds, "wire_hello", "stream", &streams);
    each(seeds, "wire_hello", "heartbeat", &[Heartbeat { incarnation: LIFE }]);
    let said = [
        FromNode::Proof { hash: [7; 32] },
        FromNode::Prepared { job: JOB, result: Err("no room".into()) },
        FromNode::Probed { job: JOB, cells: vec![(0, 1e-6), (3, 2e-6)] },
        FromNode::Failed { job: JOB, lease: LEASE, reason: "no luck".into() },
        FromNode::Cancelled { job: JOB, lease: LEASE },
        FromNode::Goodbye { reason: "it is late".into() },
    ];
    each(seeds, "wire_control", "node", &said);
    let part = RenderedPart::from_bytes(Rect { x: 3, y: 144, width: 2, height: 1 }, Aovs::NONE, Counters::default(), &[63; 24]).unwrap();
    let (job, lease) = (JobId(part.rect.x.into()), LeaseId(part.rect.y.into()));
    let header = PartHeader { job, lease, frame: AssetId::of(OBJ), seconds: 0.5, hash: part.hash(), invalid_samples: 1 };
    seeds.push(("wire_part", "two_pixels".into(), [wire::encode(&header, 256).unwrap(), part.to_bytes()].concat()));
}

fn coordinator_says(seeds: &mut Vec<Seed>) {
    let said = [
        ToNode::Prove { seed: 5 },
        ToNode::Prepare { job: JOB, frame: AssetId::of(OBJ), assets: vec![AssetId::of(PNG)] },
        ToNode::Probe { job: JOB, cells: vec![(0, RECT)], stride: 4 },
        ToNode::Render { job: JOB, lease: LEASE, rect: RECT, samples: SampleRange { first: 0, count: 4 } },
        ToNode::Cancel { job: JOB, lease: LEASE },
        ToNode::Settled { job: JOB, lease: LEASE },
        ToNode::Release { job: JOB },
    ];
    each(seeds, "wire_control", "coordinator", &said);
    let node = NodeStatus {
        id: NODE,
        name: "attic".into(),
        lanes: 8,
        address: "127.0.0.1:5".into(),
        build: "0.1.0".into(),
        state: NodeState::Ready,
        reason: String::new(),
        holds: 2,
    };
    let job = JobStatus {
        job: JOB,
        name: "job".into(),
        owner: "ann".into(),
        priority: -5,
        paused: true,
        state: JobState::Failed("no luck".into()),
        parts: 9,
        committed: 4,
        progress: 0.5,
        seconds: 3.0,
        left: Some(2.5),
        trouble: None,
    };
    let kept = KeptJob { job: JOB, name: "job".into(), submitted: 1_795_423_456, state: JobState::Incomplete(2), bytes: 4096 };
    let answers = [
        Response::Refused { reason: "no room".into() },
        Response::Wanted(vec![AssetId::of(PNG)]),
        Response::Status(Status { nodes: vec![node.clone()], jobs: vec![job.clone()], refusal: Some("full".into()) }),
        Response::Job(job, vec![node]),
        Response::Files(vec![FileHeader { name: "job.exr".into(), length: 1000 }]),
        Response::Jobs(vec![kept]),
    ];
    each(seeds, "wire_response", "answer", &answers);
    let chain = text("identity/node");
    each(seeds, "wire_join", "answer", &[JoinResponse::Refused { reason: "used".into() }, JoinResponse::Certified { chain }]);
}

fn clients_say(seeds: &mut Vec<Seed>) {
    let requests = [
        Request::Submit { description: Box::new(description()), terms: Terms { min_nodes: 2, priority: -5, after: vec![JOB] } },
        Request::Move { job: JOB, place: Place::Ranked(10) },
        Request::Move { job: JOB, place: Place::Paused },
        Request::Watch { job: JOB },
        Request::Release { node: "attic".into() },
    ];
    each(seeds, "wire_request", "asked", &requests);
    let key = seed("certificate/request");
    let token = text("token/node");
    each(seeds, "wire_join", "asked", &[JoinRequest { token: Some(token), name: Some("attic".into()), key }]);
}

fn description() -> JobDescription {
    let modules = BTreeMap::from([("module".to_owned(), ("module.lua".to_owned(), "return 1".to_owned()))]);
    let costs = CostMap { cell: 8, columns: 2, rows: 1, seconds_per_pixel: vec![1e-6, 2e-6] };
    JobDescription {
        name: "job".into(),
        frame: frame(),
        assets: vec![AssetId::of(PNG)],
        probe: Probe::Known { costs, powers: BTreeMap::from([("attic".into(), 2.0)]) },
        split: Split::Strips { count: 3 },
        assign: Assign::Script,
        audit: 0.125,
        attempts: 5,
        patience: Some(600.0),
        output: Output {
            exr: "job.exr".into(),
            png: Some("job.png".into()),
            manifest: "job.manifest.json".into(),
            pixel_type: PixelType::Half,
            exposure: 0.5,
        },
        script: Some(ScriptBundle { name: "job.lua".into(), source: "return 1".into(), modules }),
        parameters: BTreeMap::from([("spheres".into(), "3".into())]),
        warnings: vec!["a warning".into()],
    }
}

/// A frame with one of everything.
fn frame() -> Frame {
    let object = |kind, transform| Object { kind, transform, source: SourceId::default() };
    let shape = |shape, material| object(ObjectKind::Shape { shape, material }, None);
    let turned = Some([[0.0, -2.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]]);
    let inner = vec![
        shape(Shape::Sphere { center: [0.0; 3], radius: 1.0 }, 2),
        shape(Shape::Box { min: [-1.0; 3], max: [0.5; 3] }, 1),
        shape(Shape::Disc { center: [0.0, 1.0, 0.0], normal: [0.0, 0.0, 1.0], radius: 0.5 }, 0),
        shape(Shape::Rectangle { corner: [-1.0; 3], edge_u: [2.0, 0.0, 0.0], edge_v: [0.0, 1.0, 0.5] }, 1),
        shape(Shape::Cylinder { from: [0.0; 3], to: [0.0, 1.0, 0.5], radius: 0.25, capped: false }, 2),
        shape(Shape::Cone { from: [0.0, 1.0, 0.0], to: [0.0, 2.0, 0.0], radius: 0.5, to_radius: 0.0, capped: true }, 3),
    ];
    let outer = vec![
        object(ObjectKind::Instance { group: 0 }, turned),
        shape(Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }, 0),
        shape(Shape::Mesh { data: AssetId::of(&triangle()) }, 3),
        object(ObjectKind::Model { model: model(), material: None }, turned),
    ];
    let image = Texture::Image {
        file: AssetId::of(PNG),
        color_space: ColorSpace::Linear,
        wrap: [Wrap::Repeat, Wrap::Mirror],
        filter: TextureFilter::Bilinear,
        scale: [1.0; 2],
        offset: [0.0; 2],
        source: SourceId::default(),
    };
    let lights = vec![
        Light::Point { position: [3.0, 4.0, 5.0], intensity: [30.0; 3], falloff: Falloff::InverseSquare, source: SourceId::default() },
        Light::Directional { direction: [0.0, -1.0, 0.5], irradiance: [1.0; 3], angle: 0.0, source: SourceId::default() },
    ];
    Frame {
        scene: Scene {
            textures: vec![Texture::Checker { even: [0.8; 3], odd: [0.2; 3], size: 0.5 }, image],
            materials: vec![
                Material::Diffuse { reflectance: [0.5; 3], texture: Some(0) },
                Material::Mirror { reflectance: [0.9; 3] },
                Material::smooth_glass(1.5, [0.9; 3]),
                Material::Diffuse { reflectance: [0.5; 3], texture: Some(1) },
                Material::MetallicRoughness(Box::new(MetallicRoughness { base_color_texture: Some(0), ..Default::default() })),
            ],
            groups: vec![Group { objects: inner }, Group { objects: outer }],
            root: 1,
            lights,
            background: Environment::Constant([0.1, 0.2, 0.3]),
            medium: None,
        },
        camera: Camera::pinhole([0.5, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 40.0),
        film: Film { width: 16, height: 12, filter: Filter::Box },
        render: Render::Whitted { max_depth: 4, transparent_shadows: true, min_weight: 0.01 },
        quality: Quality::of(4),
        seed: 1,
        aovs: [Aov::Depth, Aov::Error].into_iter().collect(),
    }
}

/// A frame with its first objects alone.
fn small(mut frame: Frame) -> Frame {
    frame.scene.groups[0].objects.truncate(6);
    frame
}

fn square() -> MeshData {
    MeshData {
        positions: vec![[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
    }
}

fn segment() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pixels");
    let mut segment = Segment::open(&path).unwrap();
    segment.append(PartId(0), LeaseId(1), &[1; 24]).unwrap();
    segment.append(PartId(1), LEASE, &[2; 12]).unwrap();
    fs::read(path).unwrap()
}

fn picture(pixel_type: exr::PixelType, aovs: Aovs) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let pixels = (0..5 * 18).map(|i| [i as f32 * 0.01, 0.5, 2.0]).collect();
    let extra = (0..5 * 18 * aovs.numbers()).map(|i| i as f32).collect();
    let film = film::Film::from_numbers(5, 18, pixels, aovs, extra).unwrap();
    exr::write(&path, &film, pixel_type, &exr::Identity::new(FrameHash([0xab; 32]), 5)).unwrap();
    fs::read(path).unwrap()
}

/// A job from its submission to its first parts, and then these events.
fn events(further: &[Event]) -> Vec<u8> {
    let (node, incarnation, job) = (NODE, LIFE, JOB);
    let info = NodeInfo { name: "attic".into(), lanes: 2, build: "0.1.0".into(), address: "127.0.0.1:5".into() };
    let told = [
        Event::Restarted { build: BUILD, stored: Vec::new() },
        Event::NodeJoined { node, incarnation, info },
        Event::NodeProved { node, incarnation, canary: BUILD.canary },
        Event::JobSubmitted { job, spec: journal::spec() },
        Event::Prepared { node, incarnation, job, result: Ok(()) },
        Event::Probed { node, incarnation, job, cells: (0..12).map(|cell| (cell, 1e-6)).collect() },
        Event::Tick,
    ];
    told.iter().chain(further).flat_map(|event| coded(&(40_u16, event))).collect()
}

fn troubles() -> Vec<Event> {
    let (node, incarnation, job) = (NODE, LIFE, JOB);
    let lease = |number: u64| LeaseId((1 << 40) + number);
    vec![
        Event::Rendered { node, incarnation, job, lease: lease(1), hash: [1; 32], seconds: 0.1, invalid_samples: 2 },
        Event::Committed { job, lease: lease(1) },
        Event::RenderFailed { node, incarnation, job, lease: lease(2), reason: "no luck".into() },
        Event::PixelsLost { job, part: PartId(0), reason: "gone".into() },
        Event::Stopped { node, incarnation, job, lease: lease(3) },
        Event::PolicyAnswered { id: PolicyId(1), answer: Ok(Answer::Split(vec![RECT])) },
        Event::NodeHeard { node, incarnation },
        Event::NodeLeft { node, incarnation, reason: "it is late".into() },
        Event::Restarted { build: Build { revision: 2, canary: [7; 32] }, stored: Vec::new() },
        Event::JobPaused { job, reason: "by ann".into(), operator: false },
        Event::JobResumed { job, reason: "by ann".into() },
        Event::JobRanked { job, priority: 7, operator: false },
        Event::NodeDraining { node, incarnation },
        Event::NodeReleased { node },
        Event::JobCancelled { job, reason: "enough".into() },
        Event::Assembled { job, result: Ok(()) },
    ]
}
