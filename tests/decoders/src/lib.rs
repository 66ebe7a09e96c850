//! Every decoder of taut that takes bytes from outside: packets, files, reports.
//!
//! A [`Decoder`] is fed bytes; it must read them or refuse them, never panic, and what it reads must keep the promise that its function
//! states. Two users: the target in `tests/fuzz`, which searches with coverage for as long as it is let, and the test of this package, which
//! changes golden samples by a seed for a fixed number of times and watches the memory.
#![forbid(unsafe_code)]

mod boards;
mod files;
mod meshes;
pub mod mutation;
mod peripherals;
mod samples;
mod screens;
mod wire;

/// Something that takes bytes from outside.
#[derive(Clone, Copy, Debug)]
pub struct Decoder {
    /// Name, also of its corpus.
    pub name: &'static str,
    /// Reads or refuses the bytes.
    pub feed: fn(&[u8]),
    /// Valid inputs to begin with.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Most bytes of memory that one input may hold at a time: this much for each of its bytes, beside [`FIXED_MEMORY`].
    pub memory_per_byte: usize,
}

/// Memory that any decoder may hold, bytes: error texts, tables, buffers of files.
pub const FIXED_MEMORY: usize = 4 << 20;

macro_rules! decoders {
    ($($name:literal: $feed:expr, $seeds:expr, $memory:expr;)*) => {
        &[$(Decoder { name: $name, feed: $feed, seeds: $seeds, memory_per_byte: $memory }),*]
    };
}

/// All of them: name, what is fed, its seeds, and the memory per byte.
pub const DECODERS: &[Decoder] = decoders! {
    "datagram": wire::datagram, wire::datagram_seeds, 1;
    "payload": wire::payload, wire::payload_seeds, 1;
    "opener": wire::opener, wire::datagram_seeds, 1;
    "constraint_parts": wire::constraint_parts, wire::part_seeds, 1;
    "control": wire::control, wire::control_seeds, 64;
    "mesh_blob": wire::mesh_blob, wire::mesh_blob_seeds, 8;
    "vrpn_client": peripherals::vrpn_client, peripherals::vrpn_seeds, 64;
    "vrpn_server": peripherals::vrpn_server, peripherals::vrpn_seeds, 64;
    "space_mouse": peripherals::space_mouse, peripherals::space_mouse_seeds, 1;
    "python_device": peripherals::python_device, peripherals::python_device_seeds, 8;
    "http_request": peripherals::http_request, peripherals::http_seeds, 1;
    "haply_service": |bytes| text(bytes, boards::haply_service), boards::haply_service_seeds, 128;
    "arm_board": boards::arm_board, boards::arm_board_seeds, 4;
    "motor_boards": boards::motor_boards, boards::motor_boards_seeds, 1;
    "ros_wrench": peripherals::ros_wrench, peripherals::ros_wrench_seeds, 4;
    "screen_file": screens::screen_file, screens::screen_file_seeds, 8192; // a PNG's pixels, 1032 for a byte, as bytes, words and shares
    "environment_hdr": screens::environment_hdr, screens::environment_hdr_seeds, 1024;
    "picture": screens::picture, screens::picture_seeds, 24 << 10; // pixels, 2048 for a byte, as they come, as texels twice, as bytes
    "texture": wire::texture, wire::texture_seeds, 4;
    "panorama": wire::panorama, wire::panorama_seeds, 2;
    "scene_edit": |bytes| text(bytes, files::scene_edit), files::scene_edit_seeds, 64;
    "join_key": |bytes| text(bytes, files::join_key), files::join_key_seeds, 1;
    "key_file": |bytes| text(bytes, files::key_file), files::key_seeds, 1;
    "scene_toml": |bytes| text(bytes, files::scene_toml), files::scene_seeds, 1024;
    "workbench_toml": |bytes| text(bytes, files::workbench_toml), files::workbench_seeds, 1024;
    "string_geometry": |bytes| text(bytes, files::string_geometry), files::string_geometry_seeds, 1024;
    "trace_csv": |bytes| text(bytes, files::trace_csv), files::trace_seeds, 64;
    "bridge_trace_csv": files::bridge_trace_csv, files::trace_seeds, 64;
    "recording": files::recording, files::recording_seeds, 64;
    "mesh_obj": meshes::obj, meshes::obj_seeds, 256;
    "mesh_stl": meshes::stl, meshes::stl_seeds, 64;
    "mesh_ply": meshes::ply, meshes::ply_seeds, 256;
    "mesh_gltf": meshes::gltf, meshes::gltf_seeds, 1024;
};

/// Feeds what is text.
fn text(bytes: &[u8], feed: fn(&str)) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        feed(text);
    }
}

/// The decoder of this name.
pub fn named(name: &str) -> Decoder {
    let found = DECODERS.iter().find(|decoder| decoder.name == name);
    *found.unwrap_or_else(|| panic!("there is no decoder `{name}`"))
}
