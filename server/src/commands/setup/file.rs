//! The workbench file out of the answers.

use std::fmt::Write as _;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

/// Where a screen stands; the common edge of front and table is the frame's x axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Front,
    Table,
    Left,
    Right,
}

impl Place {
    pub(super) const ALL: [Self; 4] = [Self::Front, Self::Table, Self::Left, Self::Right];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Table => "table",
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Width and height unless they are measured, m.
    pub(super) fn size(self) -> (f64, f64) {
        match self {
            Self::Front | Self::Table => (1.8, 1.2),
            Self::Left | Self::Right => (1.2, 1.2),
        }
    }

    /// Lower left, lower right, upper left as the viewer sees them, m. Walls at the sides begin at the edges of a front screen of half width `edge`.
    fn corners(self, width: f64, height: f64, edge: f64) -> [[f64; 3]; 3] {
        let half = width / 2.0;
        match self {
            Self::Front => [[-half, 0.0, 0.0], [half, 0.0, 0.0], [-half, 0.0, height]],
            Self::Table => [
                [-half, -height, 0.0],
                [half, -height, 0.0],
                [-half, 0.0, 0.0],
            ],
            Self::Left => [
                [-edge, -width, 0.0],
                [-edge, 0.0, 0.0],
                [-edge, -width, height],
            ],
            Self::Right => [[edge, 0.0, 0.0], [edge, -width, 0.0], [edge, 0.0, height]],
        }
    }
}

pub(super) struct Wall {
    pub(super) place: Place,
    /// m.
    pub(super) width: f64,
    /// m.
    pub(super) height: f64,
    /// Which of the PCs.
    pub(super) drawn_by: usize,
}

pub(super) struct Pc {
    pub(super) name: String,
    pub(super) address: IpAddr,
}

pub(super) struct Answers {
    pub(super) name: String,
    pub(super) walls: Vec<Wall>,
    pub(super) stereo: &'static str,
    pub(super) device: String,
    /// The first is the haptic PC.
    pub(super) pcs: Vec<Pc>,
    /// Width, height, whether it covers its monitor.
    pub(super) window: (u32, u32, bool),
}

impl Answers {
    /// The file. What it leaves out is as in the shipped workbench, which has every key with its unit.
    pub(super) fn text(&self) -> String {
        let mut text = format!(
            "# Made by `taut setup`. Every key: the shipped workbench.toml. Units: m, s, rad, N. Frame: x to the right, y away from the viewer, z up.\n\
             name = {}\nscene = \"peg-in-a-hole\"\n\n\
             [scene_origin]\nposition = [0.0, -0.45, 0.25]              # m: above the middle of the table\n",
            quoted(&self.name)
        );
        let edge = self.walls.first().map_or(0.9, |front| front.width / 2.0);
        for wall in &self.walls {
            let [lower_left, lower_right, upper_left] =
                wall.place.corners(wall.width, wall.height, edge);
            // Writing to a string does not fail.
            let _ = write!(
                text,
                "\n[[screen]]                                 # as the viewer sees it, m: measure these\nname = \"{}\"\nlower_left = {lower_left:?}\nlower_right = {lower_right:?}\nupper_left = {upper_left:?}\n",
                wall.place.name()
            );
        }
        let (width, height, fullscreen) = self.window;
        for wall in &self.walls {
            let name = wall.place.name();
            let _ = write!(
                text,
                "\n[[node]]\nname = \"{name}\"\nscreens = [\"{name}\"]\nstereo = \"{}\"\nwindow = {{ width = {width}, height = {height}, fullscreen = {fullscreen} }}\n",
                self.stereo
            );
        }
        self.machines(&mut text);
        let device = match self.is_simulated() {
            true => "kind = \"simulated\"",
            false => {
                "kind = \"remote\"                            # taut bridge, on the machine above that has a device"
            }
        };
        let _ = write!(
            text,
            "\n[viewer]\neye_separation = 0.064                     # m\n\
             head = {{ position = [0.0, -1.3, 0.9], rotation = [0.8660254037844386, 0.5, 0.0, 0.0] }}   # looks 30 degrees down\n\
             \n[device]\n{device}\n\
             \n[network]\nbind = \"{}\"\n\
             \n[realtime]\nmode = \"waive\"                             # enforce, once `taut doctor` is content\n",
            self.bind()
        );
        text
    }

    fn machines(&self, text: &mut String) {
        for (which, pc) in self.pcs.iter().enumerate() {
            let _ = write!(
                text,
                "\n[[machine]]\nname = {}\naddress = \"{}\"\n",
                quoted(&pc.name),
                pc.address
            );
            if which == 0 {
                text.push_str("server = true\n");
                if !self.is_simulated() {
                    let _ = writeln!(text, "device = {}", quoted(&self.device));
                }
            }
            let drawn: Vec<String> = self
                .walls
                .iter()
                .filter(|wall| wall.drawn_by == which)
                .map(|wall| format!("\"{}\"", wall.place.name()))
                .collect();
            if !drawn.is_empty() {
                let _ = writeln!(text, "nodes = [{}]", drawn.join(", "));
            }
        }
    }

    /// One machine alone lets no other in.
    fn bind(&self) -> IpAddr {
        match self.pcs.as_slice() {
            [alone] => alone.address,
            [server, ..] if server.address.is_ipv6() => Ipv6Addr::UNSPECIFIED.into(),
            _ => Ipv4Addr::UNSPECIFIED.into(),
        }
    }

    fn is_simulated(&self) -> bool {
        self.device == "simulated"
    }
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted + "\""
}
