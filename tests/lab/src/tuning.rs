//! What is tuned of each method, and what is tried.

use std::fmt;

use crate::method::Method;

/// Rest distances that are tried for the paper's method, over the default: a ball on a convex surface loses a contact that is too tight. A ball of
/// 2 mm that goes round 20 mm at 0.2 m/s and 1 kHz needs 400 of them.
const TOUCHING: [f64; 4] = [5.0, 25.0, 100.0, 400.0];
/// One more, for the published method alone.
const TOUCHING_FARTHEST: f64 = 1600.0;
/// Rest distances over the default that discrete detection is tried with while it looks ahead, and steps within an update.
const TOUCHING_AHEAD: [f64; 3] = [1.0, 25.0, 400.0];
const STEPS_AHEAD: [u32; 2] = [1, 10];
/// Share of the way to the device that a body which looks ahead is tried with beside the default, k_s: that of the published method.
const SHORTER_WAY: f64 = 0.5;
/// Rest distance over the default that this project's method is tried with: a long body rests far from what it touches.
const NEARER: f64 = 0.25;
/// Inertias and damping ratios that are tried for virtual coupling. Less inertia than none there is not: the proxy is where the spring is at rest.
const PROXIES: [(f64, f64); 6] = [
    (0.02, 1.0),
    (0.1, 1.0),
    (0.1, 0.3),
    (0.02, 0.1),
    (0.005, 0.3),
    (0.0, 0.0),
];

/// Spacings of the points of the penalty method that are tried, over the body's longest side: an eighth, or the vertices alone.
pub(crate) const SHELL_SPACINGS: [f64; 2] = [0.125, f64::INFINITY];
/// What the forces on a ball add up to that is tried: it may touch several obstacles.
const ROUND: [ShellForce; 2] = [ShellForce::Deepest, ShellForce::Sum];
/// Stiffness of a contact over that of the coupling, for the methods whose contacts are penalties: an
/// implicit solution bears any.
const CONTACT_STIFFNESSES: [f64; 2] = [1e3, 1e4];
/// Finest spacing of the nested shell, over the body's longest side.
const FINE_SPACING: f64 = 0.03125;
/// Inertias and damping ratios that are tried for the tool of linearised penalty.
const TOOLS: [(f64, f64); 3] = [(0.02, 1.0), (0.005, 0.3), (0.0, 0.0)];
/// Contact distances of the two-rate LCP that are tried, in rest distances, and its alarm distance, in
/// activation distances: a tenth of the body.
const CONTACT_DISTANCES: [f64; 3] = [1.0, 10.0, 100.0];
const ALARM_DISTANCE: f64 = 25.0;
/// Distances within which the point god-object counts faces as touched that are tried, in rest distances.
const TOUCH_SHARES: [f64; 6] = [2.0, 10.0, 50.0, 250.0, 1000.0, 4000.0];

impl Method {
    /// The settings among which the best is searched for each recipe and rate; the first is the default.
    pub fn tunings(self) -> Vec<Tuning> {
        match self {
            Self::OursByDefault | Self::DoesNothing | Self::RandomForce => vec![Tuning::Default],
            Self::Ours => vec![
                Tuning::Default,
                Tuning::Way(SHORTER_WAY),
                Tuning::Touching(NEARER),
            ],
            Self::Paper | Self::PaperAdapted => {
                let farthest = Tuning::Touching(TOUCHING_FARTHEST);
                touching().chain([farthest]).collect()
            }
            Self::Discrete => {
                let each = |share: &f64| {
                    let share = *share;
                    STEPS_AHEAD.map(|steps| {
                        [None, Some(SHORTER_WAY)].map(|way| Tuning::Ahead { share, steps, way })
                    })
                };
                let ahead = TOUCHING_AHEAD.iter().flat_map(each).flatten();
                touching().chain(ahead).collect()
            }
            Self::Penalty => [ShellForce::Deepest, ShellForce::Mean]
                .iter()
                .flat_map(|force| {
                    SHELL_SPACINGS.map(|spacing| Tuning::Shell {
                        force: *force,
                        spacing,
                    })
                })
                .chain(ROUND.map(Tuning::Round))
                .collect(),
            Self::StaticCoupling => static_couplings(),
            Self::LinearisedPenalty => tools(),
            Self::TwoRateLcp => CONTACT_DISTANCES
                .iter()
                .flat_map(|contact| {
                    [None, Some(ALARM_DISTANCE)].map(|alarm| Tuning::Proximity {
                        contact: *contact,
                        alarm,
                    })
                })
                .collect(),
            Self::Point => TOUCH_SHARES.map(Tuning::Touch).into(),
            Self::VirtualCoupling => PROXIES
                .iter()
                .flat_map(|(share, damping_ratio)| {
                    [false, true].map(|goes_on| Tuning::Proxy {
                        share: *share,
                        damping_ratio: *damping_ratio,
                        goes_on,
                    })
                })
                .collect(),
        }
    }
}

/// Rest distances: the default, and those that are tried.
fn touching() -> impl Iterator<Item = Tuning> {
    let others = TOUCHING.map(Tuning::Touching);
    [Tuning::Default].into_iter().chain(others)
}

/// As published, along the normals of the points and with a body that stands between updates; and without
/// either, ever stiffer and finer.
fn static_couplings() -> Vec<Tuning> {
    let [soft, stiff] = CONTACT_STIFFNESSES;
    let spaced = ShellPoints::Spaced(SHELL_SPACINGS[0]);
    let fine = ShellPoints::Spaced(FINE_SPACING);
    let each = [
        (spaced, soft, true, false),
        (spaced, soft, false, false),
        (ShellPoints::Round, soft, false, false),
        (spaced, soft, false, true),
        (spaced, stiff, false, true),
        (fine, soft, false, true),
        (ShellPoints::Round, soft, false, true),
        (ShellPoints::Round, stiff, false, true),
    ];
    let tuning = |(points, stiffness, own_normals, goes_on)| Tuning::Static {
        points,
        stiffness,
        own_normals,
        goes_on,
    };
    each.map(tuning).into()
}

/// As published, all contacts linear as a whole; and each by itself.
fn tools() -> Vec<Tuning> {
    let [soft, stiff] = CONTACT_STIFFNESSES;
    let tuning = |(share, damping_ratio), stiffness, contacts| Tuning::Tool {
        share,
        damping_ratio,
        stiffness,
        contacts,
    };
    let whole = TOOLS.map(|tool| tuning(tool, soft, LinearContacts::Whole));
    let each = TOOLS.map(|tool| tuning(tool, soft, LinearContacts::Each));
    let lightest = TOOLS[1..].iter();
    let stiffer = lightest.map(|tool| tuning(*tool, stiff, LinearContacts::Each));
    whole.into_iter().chain(each).chain(stiffer).collect()
}

/// What is tuned of a baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tuning {
    /// Nothing.
    Default,
    /// Share of the way to the device that the body covers in an update, k_s, at the same stiffness.
    Way(f64),
    /// Rest distance of a god-object over the default; contacts within two of them touch.
    Touching(f64),
    /// Discrete detection that looks as far ahead as this project's method does.
    Ahead {
        /// Rest distance over the default.
        share: f64,
        /// Most projections, motions and collections within an update.
        steps: u32,
        /// k_s where it is not the default.
        way: Option<f64>,
    },
    /// The proxy of virtual coupling.
    Proxy {
        /// Inertia over that of the body; 0: it is where the spring is at rest.
        share: f64,
        /// Damping over critical damping.
        damping_ratio: f64,
        /// Whether it goes on between updates.
        goes_on: bool,
    },
    /// The points of the penalty method.
    Shell {
        /// What they add up to.
        force: ShellForce,
        /// Between points, over the body's longest side; infinite: the vertices alone.
        spacing: f64,
    },
    /// One point with a radius for the penalty method where the body is a ball, and else its vertices: what they add up to.
    Round(ShellForce),
    /// A point shell on a static coupling.
    Static {
        /// Of the shell.
        points: ShellPoints,
        /// Of a contact over that of the coupling.
        stiffness: f64,
        /// Forces go along the normals of the points; else along the gradient of the field.
        own_normals: bool,
        /// Whether the balance is found again for each force.
        goes_on: bool,
    },
    /// The tool of linearised penalty.
    Tool {
        /// Inertia over that of the body.
        share: f64,
        /// Damping of the coupling over critical damping.
        damping_ratio: f64,
        /// Of a contact over that of the coupling.
        stiffness: f64,
        /// What is linear between updates.
        contacts: LinearContacts,
    },
    /// Contacts by proximity of the two-rate LCP.
    Proximity {
        /// Gap that contacts keep, in rest distances.
        contact: f64,
        /// Gap within which they are looked for beyond that, in activation distances; `None`: as far as
        /// device and body may go.
        alarm: Option<f64>,
    },
    /// Distance within which the point god-object counts faces as touched, in rest distances.
    Touch(f64),
}

/// Points of a nested shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShellPoints {
    /// No farther from each other than this, over the body's longest side.
    Spaced(f64),
    /// One with a radius where the body is a ball, and else its vertices.
    Round,
}

/// What a method keeps of its contacts between updates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinearContacts {
    /// The wrench of all of them, a linear function.
    Whole,
    /// A spring of each that pushes and does not pull.
    Each,
}

impl fmt::Display for ShellPoints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spaced(spacing) => write!(f, "points; spacing {spacing} of the body"),
            Self::Round => f.write_str("a ball; else vertices"),
        }
    }
}

/// What the forces of all points in an obstacle add up to; each is the stiffness times its depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShellForce {
    /// Their sum.
    Sum,
    /// Their mean.
    Mean,
    /// The deepest alone.
    Deepest,
}

impl fmt::Display for ShellForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sum => "sum",
            Self::Mean => "mean",
            Self::Deepest => "deepest",
        })
    }
}

impl fmt::Display for Tuning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => write!(f, "default"),
            Self::Shell { force, spacing } => {
                if spacing.is_finite() {
                    write!(f, "{force} of points; spacing {spacing} of the body")
                } else {
                    write!(f, "{force} of vertices")
                }
            }
            Self::Round(force) => write!(f, "{force} of a ball; else of vertices"),
            Self::Static {
                points,
                stiffness,
                own_normals,
                goes_on,
            } => {
                let normals = if *own_normals { "; own normals" } else { "" };
                let goes_on = if *goes_on { "; goes on" } else { "" };
                write!(
                    f,
                    "{points}; contacts {stiffness} times as stiff{normals}{goes_on}"
                )
            }
            Self::Tool {
                share,
                damping_ratio,
                stiffness,
                contacts,
            } => {
                let linear = match contacts {
                    LinearContacts::Whole => "linear as a whole",
                    LinearContacts::Each => "each one-sided",
                };
                write!(
                    f,
                    "tool {share} of the body; damping ratio {damping_ratio}; contacts {stiffness} times as stiff; {linear}"
                )
            }
            Self::Proximity { contact, alarm } => {
                write!(f, "contacts keep {contact} rest distances; alarm ")?;
                match alarm {
                    Some(alarm) => write!(f, "{alarm} activation distances"),
                    None => f.write_str("as far as device and body go"),
                }
            }
            Self::Touch(share) => write!(f, "touching within {share} rest distances"),
            Self::Touching(share) => write!(f, "{share} rest distances"),
            Self::Way(way) => write!(f, "k_s {way}"),
            Self::Ahead { share, steps, way } => {
                write!(
                    f,
                    "looks ahead; {share} rest distances; at most {steps} steps"
                )?;
                way.map_or(Ok(()), |way| write!(f, "; k_s {way}"))
            }
            Self::Proxy {
                share,
                damping_ratio,
                goes_on,
            } => {
                let goes_on = if *goes_on { "; goes on" } else { "" };
                write!(
                    f,
                    "proxy {share} of the body; damping ratio {damping_ratio}{goes_on}"
                )
            }
        }
    }
}
