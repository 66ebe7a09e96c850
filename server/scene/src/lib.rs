//! Scenes, workbenches, traces and meshes as files: reading, checking, generating.
//!
//! A fault in a file is a sentence that names the file, the line and what to do ([`Problem`]); a file's faults are
//! reported together ([`FileError`]). SI units and quaternions `w x y z` in every file.
#![forbid(unsafe_code)]

mod appearance;
mod check;
mod document;
mod environment_file;
pub mod fidelity;
mod files;
mod finished_file;
mod height_map_file;
mod import;
mod lattice;
mod mesh_file;
mod picture;
mod problem;
mod progress;
mod runner;
mod scene;
pub mod shapes;
mod shell_word;
mod simplified_cache;
mod simplify;
mod trace;
mod workbench;

pub use appearance::{Appearance, srgb};
pub use check::{FaultPlaces, FileKind, FileReport, Meeting, MeshFigures, check, check_in};
pub use document::Document;
pub use environment_file::read_environment;
pub use fidelity::FidelityPlan;
pub use files::{DATA_VARIABLE, MAX_MESH_BYTES, MAX_TOML_BYTES, data_dir, data_dirs, data_file};
pub use finished_file::{FinishedFile, free_name, is_taken};
pub use import::{
    Finding, ForFile, ImportPart, ImportReport, ImportRequest, LengthUnit, MAX_HOLE_EDGES,
    PartReport, SourceReport, UpAxis, give_to_parts, import, import_unless,
};
pub use mesh_file::{
    BodyTexture, BodyTextures, RawMesh, is_mesh_path, read_mesh, read_mesh_bytes, write_ply,
};
pub use picture::read_picture;
pub use problem::{FileError, Problem};
pub use runner::{Onlooker, Runner, numbers_of_pose, pose_of_numbers};
pub use scene::{
    BodySpec, BuiltBody, BuiltHand, BuiltMotion, BuiltScene, Carried, Carrier, CouplingSpec,
    EditedKey, GOD_OBJECT_NAME, HandPathSpec, HeightMapMapping, HeightMapSpec, LimitSpec, MassSpec,
    MethodSpec, MotionSpec, ObstacleSpec, Prepared, ReferencePoint, SHIPPED_SCENES, Scene,
    SceneSource, ScenerySpec, Shape, ShippedScene, Sources, View, shipped_scene_text,
};
pub use shell_word::shell_word;
pub use simplify::{Simplified, simplify};
pub use taut_plant::HandPreset;
pub use taut_recording::{NORM_TOLERANCE, unit_quaternion};
pub use trace::{
    DeviceTrace, MAX_TRACE_TIME, REPLAY_COLUMNS, ReplayRow, ReplayWriter, TIMING_COLUMNS,
    TraceSample, looping_fault,
};
pub use workbench::{
    AlsoKeyFile, Device, DeviceDynamics, FrameSwap, Frames, HeadTracking, Log, LogLevel, Machine,
    Monitoring, NeededFile, Network, Node, ObserverStream, Operator, Passivity, RealTime,
    RealTimeMode, Rearm, SHIPPED_WORKBENCH, Safety, Screen, ScreenOutput, Show, Stereo,
    TransportKind, Viewer, Vrpn, Window, Workbench, WrenchFrame, WrenchIn, WrenchSource, Zenoh,
    is_machine_name,
};

/// Why a scene could not be used.
pub type SceneError = FileError;
/// Why a trace could not be used.
pub type TraceFileError = FileError;
