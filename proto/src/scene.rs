//! Scene description: everything a client needs to draw, except the meshes, which it asks for by hash.

use crate::{
    MeshHash, PoseF64, Untrusted,
    codec::{wire_struct, wire_tag},
    range::{
        ANGLE, COLOUR, COLOUR_MIX, EXPONENT, LENGTH, NAME, PIXELS, PUPILS, RESPONSE, SAMPLING,
        SCALE, SHARE, SIZE,
    },
};

wire_struct! {
    /// What a client learns at join, before the first state.
    #[derive(Clone, Debug, PartialEq)]
    pub struct SceneDescription {
        /// Name of the scene.
        pub name: Untrusted,
        /// Revision; [`crate::HotState::scene_revision`] refers to it.
        pub revision: u32 => NAME,
        /// The god-object.
        pub god_object: BodyDescription,
        /// The obstacles, then what is only seen; a state's body numbers are indices into this list.
        pub obstacles: Vec<BodyDescription>,
        /// Reference point of the god-object, m, in its body frame.
        pub reference_point: [f64; 3] => LENGTH,
        /// Scene frame in the workbench frame.
        pub scene_origin: PoseF64,
        /// Size of the scene on the workbench over its size in the simulation, above 0.
        pub display_scale: f64 => SCALE,
        /// The screens.
        pub screens: Vec<ScreenDescription>,
        /// The render nodes.
        pub nodes: Vec<NodeDescription>,
        /// The viewer where no head tracker says otherwise, in the workbench frame.
        pub viewer: PoseF64,
        /// Distance between the pupils, m.
        pub eye_separation: f64 => PUPILS,
        /// Near clipping distance, m.
        pub near: f64 => SIZE,
        /// Far clipping distance, m.
        pub far: f64 => SIZE,
        /// Factor on `eye_separation` with which pictures are drawn, 0 to 1: below 1 the world is flatter and easier on the eyes.
        pub separation_scale: f64 => SHARE,
        /// Most that anything may stand out towards the viewer, as an angle between the eyes, rad; 0 is no limit.
        pub nearest_disparity: f64 => ANGLE,
        /// What is drawn besides the scene.
        pub show: Show,
        /// The light around the scene, by the hash of its [`crate::Panorama`]; `None` is the studio that every node knows.
        pub environment: Option<MeshHash>,
    }
}

impl SceneDescription {
    /// A scene of one body and nothing else: no screens, the workbench's frame for its own, 64 mm between the pupils.
    #[must_use]
    pub fn of_body(name: &str, god_object: BodyDescription) -> Self {
        Self {
            name: name.into(),
            revision: 1,
            god_object,
            obstacles: Vec::new(),
            reference_point: [0.0; 3],
            scene_origin: PoseF64::IDENTITY,
            display_scale: 1.0,
            screens: Vec::new(),
            nodes: Vec::new(),
            viewer: PoseF64::IDENTITY,
            eye_separation: 0.064,
            near: 0.05,
            far: 10.0,
            separation_scale: 1.0,
            nearest_disparity: 0.0,
            show: Show::default(),
            environment: None,
        }
    }
}

wire_struct! {
    /// A body: mesh by hash, pose at start, colour.
    #[derive(Clone, Debug, PartialEq)]
    pub struct BodyDescription {
        /// Name, unique in the scene.
        pub name: Untrusted,
        /// Mesh, in the body's own frame.
        pub mesh: MeshHash,
        /// Body in the scene frame at start.
        pub pose: PoseF64,
        /// Linear RGB and opacity, 0 to 1.
        pub colour: [f32; 4] => COLOUR,
    }
}

wire_struct! {
    /// A flat screen by three corners, m, workbench frame.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ScreenDescription {
        /// Name, unique in the workbench.
        pub name: Untrusted,
        /// Lower left corner as the viewer sees it.
        pub lower_left: [f64; 3] => LENGTH,
        /// Lower right corner.
        pub lower_right: [f64; 3] => LENGTH,
        /// Upper left corner.
        pub upper_left: [f64; 3] => LENGTH,
        /// How its picture becomes what its projector or monitor gets.
        pub output: OutputDescription,
    }
}

wire_struct! {
    /// How the picture of a screen is corrected for what shows it. Files are named as the workbench file names them, and are read
    /// by the nodes that draw the screen; of a list, the one file is for both eyes, or the first for the left and the
    /// second for the right.
    #[derive(Clone, Debug, PartialEq)]
    pub struct OutputDescription {
        /// Meshes that warp the flat picture; none leaves it.
        pub warp: Vec<Untrusted>,
        /// Points of the surface that is lit, instead of the flat screen; none has the flat screen.
        pub surface: Vec<Untrusted>,
        /// Masks of the light that each pixel keeps; none keeps all.
        pub blend: Vec<Untrusted>,
        /// Exponent that makes a mask's values shares of light.
        pub blend_gamma: f64 => EXPONENT,
        /// Light sent for light wanted, both linear red, green and blue; row by row.
        pub colour: [f64; 9] => COLOUR_MIX,
        /// Exponents of the responses of red, green and blue, light over signal; 0 is that of sRGB.
        pub gamma: [f64; 3] => RESPONSE,
        /// Pixels that are drawn for a pixel of the output, each way, before they are warped.
        pub sampling: f64 => SAMPLING,
    }
}

impl Default for OutputDescription {
    /// The picture as it is drawn.
    fn default() -> Self {
        Self {
            warp: Vec::new(),
            surface: Vec::new(),
            blend: Vec::new(),
            blend_gamma: 1.0,
            colour: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            gamma: [0.0; 3],
            sampling: 1.0,
        }
    }
}

wire_struct! {
    /// A render node.
    #[derive(Clone, Debug, PartialEq)]
    pub struct NodeDescription {
        /// Name that the node gives in its Hello.
        pub name: Untrusted,
        /// Names of the screens that it draws.
        pub screens: Vec<Untrusted>,
        /// How it shows two eyes.
        pub stereo: Stereo,
        /// Its window.
        pub window: WindowDescription,
        /// Which monitors its windows cover, in the order of the windows: an output's name such as DP-1, or its number from 0.
        /// Windows past the end take the monitors that follow.
        pub monitors: Vec<Untrusted>,
    }
}

/// How two eyes reach a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stereo {
    /// One view from between the eyes.
    #[default]
    Mono,
    /// Left half of the picture for the left eye.
    SideBySide,
    /// Upper half of the picture for the left eye.
    TopBottom,
    /// Both eyes over each other, red for the left and cyan for the right.
    Anaglyph,
    /// A window for each eye: two projectors or two outputs.
    TwoWindows,
}

impl Stereo {
    /// All, with their names in files and on command lines.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("mono", Self::Mono),
        ("side-by-side", Self::SideBySide),
        ("top-bottom", Self::TopBottom),
        ("anaglyph", Self::Anaglyph),
        ("two-windows", Self::TwoWindows),
    ];

    /// Size of the picture, in pixels, that gives each eye `width` × `height`.
    pub fn picture_size(self, (width, height): (u32, u32)) -> (u32, u32) {
        match self {
            Self::SideBySide => (width.saturating_mul(2), height),
            Self::TopBottom => (width, height.saturating_mul(2)),
            Self::Mono | Self::Anaglyph | Self::TwoWindows => (width, height),
        }
    }

    /// Size of one eye's view, in pixels, in a picture of `width` × `height`; an odd pixel is left out.
    pub fn view_size(self, (width, height): (u32, u32)) -> (u32, u32) {
        match self {
            Self::SideBySide => ((width / 2).max(1), height),
            Self::TopBottom => (width, (height / 2).max(1)),
            Self::Mono | Self::Anaglyph | Self::TwoWindows => (width, height),
        }
    }
}

wire_struct! {
    /// A window.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct WindowDescription {
        /// Pixels.
        pub width: u32 => PIXELS,
        /// Pixels.
        pub height: u32 => PIXELS,
        /// Without frame, over the whole monitor.
        pub fullscreen: bool,
    }
}

wire_struct! {
    /// What is drawn besides the scene, and with what effort; nothing besides by default: the paper shows the user the god-object only.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Show {
        /// The device pose as a translucent copy of the god-object.
        pub ghost: bool,
        /// Contact points as dots.
        pub contacts: bool,
        /// The force on the hand as an arrow.
        pub force: bool,
        /// Lines of text about the node: its link, its frames, the age of what it draws.
        pub hud: bool,
        /// Surfaces mirror what is around them; without, they only get its light.
        pub reflections: bool,
    }
}

impl Default for Show {
    fn default() -> Self {
        Self {
            ghost: false,
            contacts: false,
            force: false,
            hud: false,
            reflections: true,
        }
    }
}

wire_tag!(Stereo, "stereo mode" { Mono = 0, SideBySide = 1, TopBottom = 2, Anaglyph = 3, TwoWindows = 4 });
