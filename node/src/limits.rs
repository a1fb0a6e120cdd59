//! Every bound of the program, in one place: what is not bounded here is not bounded at all.
//!
//! Names end in their unit where it is not plain. A bound that a user may move stands in [`crate::config`] with its default here.

use std::time::Duration;

// ---- Failure detection -------------------------------------------------------------------------------------------------

/// How often a node sends a heartbeat.
pub const HEARTBEAT_INTERVAL: Duration = Duration::from_millis(100);

/// Silence after which a node is suspected and its parts are given to others.
pub const SUSPECT_AFTER: Duration = Duration::from_millis(700);

/// Silence after which a suspected node is declared dead: its incarnation is void from then on.
pub const DEAD_AFTER: Duration = Duration::from_secs(10);

/// How long a job without any node waits for one before it fails.
pub const NO_NODE_TIMEOUT: Duration = Duration::from_secs(60);

/// How often the service manager's watchdog is fed within its patience.
pub const WATCHDOG_FEEDS: u32 = 4;

// ---- Nodes -------------------------------------------------------------------------------------------------------------

/// How far rendering threads stand back behind others, the network's thread first of all.
pub const LANE_NICENESS: i32 = 5;

/// How long a node that is told to end may take to finish what its lanes render, if it is not told otherwise.
pub const DRAIN_LIMIT: Duration = Duration::from_secs(60);

/// Fetched assets that a node keeps, if it is not told otherwise.
pub const CACHE_BYTES: u64 = 8 << 30;

// ---- The wire ----------------------------------------------------------------------------------------------------------

/// Silence after which QUIC gives a connection up: above [`DEAD_AFTER`], for the core is to decide who is dead.
pub const IDLE_TIMEOUT: Duration = Duration::from_secs(15);

/// Silence after which QUIC itself sends a packet.
pub const KEEP_ALIVE: Duration = Duration::from_secs(1);

/// Packets that may overtake another before QUIC takes that for lost, and sends ever less: on a network with jitter, many do.
pub const OVERTAKING_PACKETS: u32 = 1000;

/// The same by time, in round trips: with jitter, one round trip is several times another.
pub const OVERTAKING_TIME: f32 = 4.0;

/// Silence of the coordinator after which a node connects anew.
pub const COORDINATOR_SILENCE: Duration = Duration::from_secs(3);

/// How long a connection may take to stand.
pub const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Silence of a coordinator after which a client says that it waits.
pub const SILENCE_SAID_AFTER: Duration = Duration::from_millis(500);

/// How long a client that follows a job waits for a coordinator that went away: for one that is upgraded, or whose machine starts anew.
pub const RETURN_PATIENCE: Duration = Duration::from_secs(600);

/// Pauses between its attempts to connect.
pub const RETURN_PAUSE: Duration = Duration::from_millis(500);

/// How often a client submits a job whose submission the coordinator did not outlive.
pub const SUBMISSIONS: u32 = 4;

/// Pauses between a node's attempts to connect: from the first, doubling, to the last.
pub const RECONNECT_PAUSE: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(5));

/// How long the last words on a connection may take.
pub const FAREWELL: Duration = Duration::from_millis(200);

/// Streams that a peer may hold open at once, of either direction.
pub const STREAMS_PER_PEER: u32 = 64;

/// Bytes of one stream that may be under way.
pub const STREAM_WINDOW_BYTES: u32 = 8 << 20;

/// Bytes of all streams of one connection that may be under way.
pub const RECEIVE_WINDOW_BYTES: u32 = 32 << 20;

/// Bytes of packets that have come to the coordinator and are not read yet: room for what a thousand nodes send while it is busy elsewhere.
pub const SOCKET_BYTES: usize = 64 << 20;

/// Bytes that a reader makes room for at once: more comes only as bytes do.
pub const READ_CHUNK_BYTES: usize = 64 << 10;

/// A [`crate::wire::NodeStream`] frame.
pub const HELLO_BYTES: usize = 4 << 10;

/// A frame of a control stream. Probe messages hold every cell of a frame.
pub const CONTROL_BYTES: usize = 16 << 20;

/// Pixels of one frame.
pub const PIXELS_PER_FRAME: u64 = 1 << 30;

/// A [`crate::wire::PartHeader`] frame.
pub const PART_HEADER_BYTES: usize = 256;

/// Share of a picture's samples that may be invalid: beyond it, the picture stands, but it is an error.
pub const INVALID_SAMPLES: f64 = 1e-4;

/// Pixels of one part.
pub const PART_BYTES: usize = 1 << 30;

/// Bytes of a part that is hashed where it comes in: handing it to another thread would take as long.
pub const HASHED_AT_ONCE_BYTES: usize = 256 << 10;

/// A [`crate::wire::Request`] frame: a submission holds a whole description.
pub const REQUEST_BYTES: usize = 256 << 20;

/// A [`crate::wire::Response`] frame.
pub const RESPONSE_BYTES: usize = 64 << 20;

/// One asset.
pub const ASSET_BYTES: usize = 4 << 30;

/// One output file.
pub const FILE_BYTES: u64 = 64 << 30;

/// Events and parts that reach the disk with one wait for it.
pub const JOURNAL_BATCH: usize = 1024;

/// Pause before a write is tried again that the disk refused.
pub const DISK_RETRY: Duration = Duration::from_secs(1);

/// How often the coordinator looks how much room its disk has.
pub const SPACE_INTERVAL: Duration = Duration::from_secs(5);

/// Bytes that stay free on the coordinator's disk, if it is not told otherwise: jobs that would need them are refused.
pub const FREE_BYTES: u64 = 1 << 30;

/// How long jobs that are over are kept, with their files, if the coordinator is not told otherwise.
pub const KEPT_FOR: Duration = Duration::from_secs(30 * 86_400);

/// Bytes of all jobs that are over, if the coordinator is not told otherwise; the oldest go first.
pub const KEPT_BYTES: u64 = 100 << 30;

/// How long a job that is over stays whatever the limits say: its client may be about to fetch its files.
pub const KEPT_AT_LEAST: Duration = Duration::from_secs(3600);

/// How often the coordinator removes old jobs, and assets that no job needs.
pub const SWEEP_INTERVAL: Duration = Duration::from_secs(600);

/// How often the farm's status is published to those who watch.
pub const STATUS_INTERVAL: Duration = Duration::from_millis(100);

/// While a deadline is set, the coordinator's core looks at the clock at least this often, so that it knows for how long it was away.
pub const WAKE_INTERVAL: Duration = Duration::from_secs(1);

/// A deadline missed by more than this means that the coordinator itself did not run.
pub const LATE_TICK: Duration = Duration::from_millis(300);

/// Events that wait for the farm's core; who adds one more waits.
pub const EVENT_QUEUE: usize = 4096;

/// Events that the core takes in one go, before it looks at the clock.
pub const INPUT_BATCH: usize = 1024;

/// Messages that wait for one peer; a peer that does not take them is disconnected.
pub const PEER_QUEUE: usize = 65_536;

// ---- Identities --------------------------------------------------------------------------------------------------------

/// How long a certificate is valid.
pub const CERTIFICATE_VALIDITY: Duration = Duration::from_hours(365 * 24);

/// How long a farm's authority is valid.
pub const AUTHORITY_VALIDITY: Duration = Duration::from_hours(3650 * 24);

/// How much earlier than now a certificate begins, for clocks that are behind.
pub const CERTIFICATE_BACKDATE: Duration = Duration::from_hours(1);

/// How long before its end a certificate is complained about.
pub const EXPIRY_WARNING: Duration = Duration::from_hours(30 * 24);

/// How often the coordinator looks whether its list of revoked certificates has changed; it reads one that it has seen twice.
pub const REVOCATION_INTERVAL: Duration = Duration::from_millis(500);

/// A list of revoked certificates.
pub const REVOCATION_BYTES: u64 = 4 << 20;

/// How long a join token is good for, if it is not told otherwise.
pub const TOKEN_VALIDITY: Duration = Duration::from_hours(1);

/// A file with a join token.
pub const TOKEN_BYTES: u64 = 4 << 10;

/// A request to join, or its answer.
pub const JOIN_BYTES: usize = 16 << 10;

/// How long a request to join may take.
pub const JOIN_PATIENCE: Duration = Duration::from_secs(10);

/// Those who join at once; more have to try again.
pub const JOINERS: usize = 16;

/// Names and tokens that the coordinator keeps in mind.
pub const REGISTER: usize = 50_000;

/// A name in a certificate.
pub const NAME_BYTES: usize = 64;

/// A file with a key and certificates.
pub const KEY_FILE_BYTES: u64 = 64 << 10;

// ---- Peers that mean harm ----------------------------------------------------------------------------------------------

/// Handshakes under way at once; whoever comes beyond that has to try again.
pub const HANDSHAKES: usize = 256;

/// Connections of all peers.
pub const CONNECTIONS: usize = 24_000;

/// Connections of one node: the present one, those that broke and are not given up yet, and attempts of another process with its key.
pub const CONNECTIONS_PER_NODE: usize = 8;

/// How long a node's connection counts after its end.
pub const NODE_REST: Duration = Duration::from_secs(1);

/// Connections of one client's key.
pub const CONNECTIONS_PER_CLIENT: usize = 32;

/// Rendering threads of one node.
pub const LANES: u32 = 4096;

/// Bytes of a frame that is read without asking for room.
pub const SMALL_FRAME_BYTES: usize = 64 << 10;

/// Bytes of all larger frames that are read, or wait to be handled, at once: of one request at the least.
pub const LARGE_FRAMES_BYTES: usize = 512 << 20;

/// How long a peer may take with a frame or an asset, however small.
pub const FRAME_PATIENCE: Duration = Duration::from_secs(10);

/// What it has to send in each further second.
pub const SLOWEST_BYTES_PER_SECOND: u64 = 64 << 10;

/// Bytes of a reason that a peer gives; the rest is cut off.
pub const REASON_BYTES: usize = 1 << 10;

/// Requests of one client's connection at once.
pub const REQUESTS_PER_CLIENT: u32 = 16;

/// Streams that a peer may open before it is known who it is.
pub const FIRST_STREAMS: u32 = 2;

/// Signs of life that a node may give between two heartbeats; more are not handed on.
pub const HEARTBEATS_PER_INTERVAL: u32 = 4;

/// Bytes of assets and jobs that one submitter may leave with the coordinator, if it is not told otherwise.
pub const SUBMITTER_BYTES: u64 = 64 << 30;

/// Jobs of one submitter that wait or run.
pub const JOBS_PER_SUBMITTER: usize = 2_000;

/// What an asset counts at the least against that.
pub const ASSET_LEAST_BYTES: u64 = 4 << 10;

/// Assets of one job.
pub const ASSETS_PER_JOB: usize = 100_000;

/// Bytes that a peer may send before it is known who it is.
pub const FIRST_WINDOW_BYTES: u32 = 256 << 10;

/// Bytes under way in either direction of a client's connection.
pub const CLIENT_WINDOW_BYTES: u32 = 8 << 20;

/// Refusals that are logged within [`REFUSAL_LOG_INTERVAL`]; more are counted.
pub const REFUSALS_LOGGED: u32 = 10;

/// See [`REFUSALS_LOGGED`].
pub const REFUSAL_LOG_INTERVAL: Duration = Duration::from_secs(10);

/// How long a node keeps quiet about the same trouble.
pub const COMPLAINT_INTERVAL: Duration = Duration::from_secs(60);

/// A node that was heard within this time lives: another process with its key is turned away.
pub const TWIN_SILENCE: Duration = Duration::from_millis(300);

// ---- A job's beginning -------------------------------------------------------------------------------------------------

/// How long a job waits for the nodes it asked for; then it begins with those that are there.
pub const GATHER_TIMEOUT: Duration = Duration::from_secs(10);

/// How long a node may take to fetch and compile a scene before it is left out of the job.
pub const PREPARE_TIMEOUT: Duration = Duration::from_secs(600);

/// How long nodes that are still preparing hold up those that are prepared. Late ones join while the job runs.
pub const PREPARE_GRACE: Duration = Duration::from_secs(5);

/// How long a probe without any answer may take; then every pixel counts as equally hard.
pub const PROBE_TIMEOUT: Duration = Duration::from_secs(600);

/// The least time that nodes which have not answered the probe hold up those that have. Late ones join while the job runs.
pub const PROBE_GRACE: Duration = Duration::from_secs(2);

// ---- The farm's memory -------------------------------------------------------------------------------------------------

/// Nodes that the coordinator knows by name.
pub const NODES: usize = 20_000;

/// Jobs that wait or run.
pub const JOBS_WAITING: usize = 4_000;

/// How many of them are for operators alone.
pub const JOBS_FOR_OPERATORS: usize = 500;

/// Jobs that have begun, are not over and do not wait for anything; and all of one submitter that have begun: nodes hold their scenes in memory.
pub const JOBS_AT_ONCE: usize = 8;

/// Where submitters share: a job hands out one part in its turn, and one more for so many nodes.
pub const NODES_PER_TURN: usize = 16;

/// Ranks of jobs: from minus this to this.
pub const PRIORITY: i32 = 100;

/// Frames of one sequence.
pub const FRAMES_PER_SEQUENCE: usize = 2_000;

/// Seconds that a job may be told to wait for a node: a year.
pub const LONGEST_PATIENCE: f64 = 365.0 * 86_400.0;

/// Jobs that one job waits for.
pub const JOBS_AWAITED: usize = 64;

/// Jobs that are over and still known.
pub const JOBS_KEPT: usize = 1_000;

/// Events in a journal beyond which a snapshot of the farm takes their place: a bound of the time that a start takes.
pub const JOURNAL_EVENTS: u64 = 100_000;

/// Length of the journal's file above which room that a snapshot freed is given back to the disk.
pub const JOURNAL_COMPACTED_BYTES: u64 = 256 << 20;

/// Entries in the list of a job's events; later ones are counted, not listed.
pub const EVENTS_PER_JOB: usize = 100_000;

/// Attempts listed with one part; later ones are not listed.
pub const ATTEMPTS_LISTED_PER_PART: usize = 64;

// ---- Policies ----------------------------------------------------------------------------------------------------------

/// How long a job's own policy may think when parts are redistributed; then the built-in decides.
pub const REDISTRIBUTE_POLICY_TIMEOUT: Duration = Duration::from_millis(50);

/// How long a job's own policy may think before rendering begins; then the job fails.
pub const POLICY_TIMEOUT: Duration = Duration::from_secs(10);

/// How long the farm waits for that, the run of the script that may come before it included.
pub const POLICY_PATIENCE: Duration = SCRIPT_TIME.saturating_add(POLICY_TIMEOUT);

// ---- Parts -------------------------------------------------------------------------------------------------------------

/// Parts of one job at the most: a frame of 32,768 x 32,768 pixels in parts of 64 x 64, and room for those that are cut up.
pub const PARTS_PER_JOB: usize = 300_000;

/// Failures of a part, each on another node where there is one, after which it is cut up or left out, if the job does not say otherwise.
pub const ATTEMPTS_PER_PART: u32 = 3;

/// What a job may say.
pub const MOST_ATTEMPTS_PER_PART: u32 = 100;

/// Longest edge of a part that is left out of the picture rather than cut up again.
pub const HOLE_EDGE: u32 = 8;

/// Parts of a job that may be cut up or left out because they failed; one more, and the job fails.
pub const NARROWED_PER_JOB: usize = 64;

/// An attempt is overdue when it has taken so many times what was predicted ...
pub const OVERDUE_FACTOR: f64 = 3.0;

/// ... and at least this long.
pub const OVERDUE_AFTER: Duration = Duration::from_secs(2);

/// Pieces into which a running part is cut for idle lanes, at the most.
pub const PIECES: usize = 16;

/// Shortest edge of such a piece, in pixels.
pub const PIECE_EDGE: u32 = 16;

/// What cutting up costs: the way to the nodes and back.
pub const PIECE_SECONDS: Duration = Duration::from_millis(50);

/// Cells of a probe at the most; a finer probe gets larger cells.
pub const PROBE_CELLS: u64 = 65_536;

/// Cells that every node measures in a shared probe, along each axis.
pub const PROBE_PATCH_PER_AXIS: u32 = 4;

/// Parts a node holds beyond those its lanes render, so that no lane waits for the network.
pub const PREFETCH_PER_LANE: usize = 1;

/// Further attempts of its own queue that a node may hold for each of its lanes where the way to it takes long.
pub const DEEPEST_PREFETCH: usize = 7;

/// Share of the time for which lanes may wait for parts before their node gets more in advance.
pub const WAITING_SHARE: f64 = 0.02;

/// The least wait for a part, on the average, that is worth it.
pub const LEAST_WAITING: Duration = Duration::from_millis(1);

/// The most that a lane is taken to have waited for one part: what takes longer is no network.
pub const MOST_WAITING: Duration = Duration::from_secs(2);

/// Between two looks at how nodes could help others, for each node: a bound of the share of its time that a coordinator spends with it.
pub const HELP_PAUSE_PER_NODE: Duration = Duration::from_micros(20);

/// How often a node that found nothing worth taking from another looks again.
pub const STEAL_INTERVAL: Duration = Duration::from_millis(200);

// ---- Job scripts -------------------------------------------------------------------------------------------------------

/// Memory of a script's virtual machine.
pub const SCRIPT_MEMORY_BYTES: usize = 1 << 30;

/// Run time of a job script until its description stands.
pub const SCRIPT_TIME: Duration = Duration::from_secs(30);

/// Bytes of one script file.
pub const SCRIPT_FILE_BYTES: u64 = 8 << 20;

/// Bytes of a Lua file of which native code is made; longer ones are lists that programs wrote: they run once, and that is faster than making code of them.
pub const SCRIPT_NATIVE_BYTES: usize = 256 << 10;

/// Lua modules of one job.
pub const SCRIPT_MODULES: usize = 256;

/// Objects (shapes, materials, lights ...) that one script makes.
pub const SCRIPT_OBJECTS: usize = 2_000_000;

/// Groups within groups.
pub const SCRIPT_GROUP_DEPTH: u32 = 32;

/// Bytes of all files and meshes of one job.
pub const SCRIPT_ASSET_BYTES: u64 = 4 << 30;

/// Bytes that a script may print.
pub const SCRIPT_PRINT_BYTES: usize = 64 << 10;

/// Files that one model refers to.
pub const MODEL_PARTS: usize = 4096;

/// Samples of a pixel.
pub const SAMPLES_PER_PIXEL: u32 = 1 << 16;
/// Highest number of a job's first sample: numbers of scripts are exact up to here.
pub const FIRST_SAMPLE: u64 = 1 << 53;

// ---- Reports -----------------------------------------------------------------------------------------------------------

/// Bytes of a manifest that is read: room for [`PARTS_PER_JOB`] parts with several attempts each.
pub const MANIFEST_BYTES: u64 = 1 << 28;

// ---- Status page -------------------------------------------------------------------------------------------------------

/// Parts of a job that are shown one by one.
pub const STATUS_PARTS: usize = 20_000;
