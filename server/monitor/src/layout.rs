//! The layout ("blueprint") that makes the page readable at first sight.
//!
//! ```text
//! +----------------------+-----------+
//! |                      | force     |
//! |   3D                 +-----------+
//! |                      | torque    |
//! |                      +-----------+
//! |                      | loops     |
//! +------------+---------+-----------+
//! | log        | contacts| age | net |
//! +------------+---------+-----------+
//! ```
//!
//! rerun's own layout builder cannot set the eye, the plots' time window or their legends, so the same messages that
//! it would send are written here.

use nalgebra::{Rotation3, Vector3};
use rerun::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, PanelState, PlayState,
};
use rerun::external::re_log_types::{BlueprintActivationCommand, EntityPath};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, PanelBlueprint, PlotLegend, ScalarAxis,
    TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
    VisibleTimeRanges,
};
use rerun::external::uuid::Uuid;
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use crate::picture::Bounds;
use crate::scene::MonitorScene;
use crate::stream::TIMELINE;
use crate::{APPLICATION, colours, paths};

/// The plots show this much of the newest past, seconds.
const PLOT_WINDOW_S: f64 = 12.0;
/// Distance of the eye from the scene's centre, in half diagonals of the scene.
const EYE_DISTANCE: f64 = 2.1;
/// Direction of the eye from the scene's centre, for z up: from the front right, from above.
const EYE_DIRECTION: [f64; 3] = [0.9, -1.3, 0.75];

/// Sends the layout and makes it the active one.
pub(crate) fn send(stream: &RecordingStream, scene: &MonitorScene) -> RecordingStreamResult<()> {
    let (blueprint, messages) = RecordingStreamBuilder::new(APPLICATION)
        .recording_id(Uuid::new_v4().to_string())
        .blueprint()
        .memory()?;
    blueprint.set_log_time_enabled(false);
    blueprint.set_time_sequence("blueprint", 0);

    let root = Layout::new(&blueprint).page(scene)?;
    let viewport = ViewportBlueprint::new()
        .with_root_container(*root.as_bytes())
        .with_auto_layout(false)
        .with_auto_views(false);
    blueprint.log("viewport", &viewport)?;
    for panel in ["blueprint_panel", "selection_panel"] {
        let hidden = PanelBlueprint::new().with_state(PanelState::Collapsed);
        blueprint.log(panel, &hidden)?;
    }
    let time_panel = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TIMELINE)
        .with_play_state(PlayState::Following);
    blueprint.log("time_panel", &time_panel)?;

    let messages = messages.take();
    if let Some(first) = messages.first() {
        let activation = BlueprintActivationCommand {
            blueprint_id: first.store_id().clone(),
            make_active: true,
            make_default: true,
        };
        stream.send_blueprint(messages, activation);
    }
    Ok(())
}

/// Writes views and containers; each gets a new id.
struct Layout<'a> {
    blueprint: &'a RecordingStream,
}

/// A view or container in the layout, and its share of the space.
struct Placed {
    path: String,
    share: f32,
}

impl<'a> Layout<'a> {
    fn new(blueprint: &'a RecordingStream) -> Layout<'a> {
        Layout { blueprint }
    }

    /// The whole page; the id of its outermost container.
    fn page(&self, scene: &MonitorScene) -> RecordingStreamResult<Uuid> {
        let picture = self.picture(scene)?;
        let plots = self.container(
            ContainerKind::Vertical,
            &[
                self.plot("Force on the hand (N)", &[paths::FORCE], 1.0)?,
                self.plot("Torque on the hand (N m)", &[paths::TORQUE], 1.0)?,
                self.plot("Loop times (µs)", &[paths::LOOPS], 1.2)?,
            ],
            1.0,
        )?;
        let above = self.container(
            ContainerKind::Horizontal,
            &[
                Placed {
                    share: 1.7,
                    ..picture
                },
                plots.1,
            ],
            3.0,
        )?;
        let below = self.container(
            ContainerKind::Horizontal,
            &[
                self.view("TextLog", "Log", paths::LOG, &[paths::LOG], 1.7)?
                    .1,
                self.plot("Contacts", &[paths::CONTACT_COUNT], 1.0)?,
                self.plot("Smallest gap (mm)", &[paths::GAP], 1.0)?,
                self.plot("Constraint age (µs)", &[paths::CONSTRAINT_AGE], 1.0)?,
                self.plot("Datagrams", &[paths::NETWORK], 1.0)?,
            ],
            1.0,
        )?;
        let page = self.container(ContainerKind::Vertical, &[above.1, below.1], 1.0)?;
        Ok(page.0)
    }

    /// The 3D view, its eye placed so that all bodies are seen.
    fn picture(&self, scene: &MonitorScene) -> RecordingStreamResult<Placed> {
        let content = [&format!("{}/**", paths::WORLD)[..]];
        let (id, placed) = self.view("3D", "Scene", paths::WORLD, &content, 1.0)?;
        let background =
            Background::new(BackgroundKind::SolidColor).with_color(colours::BACKGROUND);
        self.property(id, "Background", &background)?;
        if let Some(bounds) = Bounds::of_bodies(scene) {
            let up = scene.up.try_normalize(0.0).unwrap_or_else(Vector3::z);
            let turn = Rotation3::rotation_between(&Vector3::z(), &up).unwrap_or_else(|| {
                Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
            });
            let direction = (turn * Vector3::from(EYE_DIRECTION))
                .try_normalize(0.0)
                .unwrap_or_else(Vector3::x);
            let centre = bounds.centre();
            let eye = centre + direction * (EYE_DISTANCE * bounds.half_diagonal());
            let to_array = |v: Vector3<f64>| -> [f32; 3] { v.map(|x| x as f32).into() };
            let controls = EyeControls3D::new()
                .with_position(to_array(eye.coords))
                .with_look_target(to_array(centre.coords))
                .with_eye_up(to_array(up));
            self.property(id, "EyeControls3D", &controls)?;
        }
        Ok(placed)
    }

    /// A plot of the newest [`PLOT_WINDOW_S`] seconds.
    fn plot(&self, name: &str, content: &[&str], share: f32) -> RecordingStreamResult<Placed> {
        let (id, placed) = self.view("TimeSeries", name, "plots", content, share)?;
        let legend = PlotLegend::new().with_corner(Corner2D::LeftTop);
        self.property(id, "PlotLegend", &legend)?;
        self.property(id, "ScalarAxis", &ScalarAxis::new().with_zoom_lock(true))?;
        self.property(
            id,
            "TimeAxis",
            &TimeAxis::new().with_view_range(plot_window()),
        )?;
        let ranges =
            VisibleTimeRanges::new(
                [rerun::external::re_sdk_types::datatypes::VisibleTimeRange {
                    timeline: TIMELINE.into(),
                    range: plot_window(),
                }],
            );
        self.property(id, "VisibleTimeRanges", &ranges)?;
        Ok(placed)
    }

    fn view(
        &self,
        class: &str,
        name: &str,
        origin: &str,
        content: &[&str],
        share: f32,
    ) -> RecordingStreamResult<(Uuid, Placed)> {
        let id = Uuid::new_v4();
        let path = format!("view/{id}");
        let view = ViewBlueprint::new(class)
            .with_display_name(name)
            .with_space_origin(origin);
        self.blueprint.log(path.as_str(), &view)?;
        let queries = content.iter().map(|path| format!("+ /{path}"));
        self.property(id, "ViewContents", &ViewContents::new(queries))?;
        Ok((id, Placed { path, share }))
    }

    fn property(
        &self,
        view: Uuid,
        name: &str,
        property: &dyn AsComponents,
    ) -> RecordingStreamResult<()> {
        let path = EntityPath::from(format!("view/{view}/{name}"));
        self.blueprint.log(path, property)
    }

    fn container(
        &self,
        kind: ContainerKind,
        children: &[Placed],
        share: f32,
    ) -> RecordingStreamResult<(Uuid, Placed)> {
        let id = Uuid::new_v4();
        let path = format!("container/{id}");
        let shares = children.iter().map(|child| child.share);
        let container = ContainerBlueprint::new(kind)
            .with_contents(children.iter().map(|child| child.path.as_str()));
        let container = match kind {
            ContainerKind::Horizontal => container.with_col_shares(shares),
            _ => container.with_row_shares(shares),
        };
        self.blueprint.log(path.as_str(), &container)?;
        Ok((id, Placed { path, share }))
    }
}

/// From [`PLOT_WINDOW_S`] before the time shown until then.
fn plot_window() -> rerun::external::re_sdk_types::datatypes::TimeRange {
    use rerun::external::re_sdk_types::datatypes::{
        TimeInt as RelativeTime, TimeRange, TimeRangeBoundary,
    };
    TimeRange {
        start: TimeRangeBoundary::CursorRelative(RelativeTime((-1e9 * PLOT_WINDOW_S) as i64)),
        end: TimeRangeBoundary::CursorRelative(RelativeTime(0)),
    }
}
