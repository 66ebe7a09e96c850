//! Draws without a window: to PNG files, or to nowhere to see how a node keeps up.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use taut_proto::scene::Show;

use crate::canvas::{Canvas, eyes_of};
use crate::error::RenderError;
use crate::node_status::LinkHealth;
use crate::pacing::Pacer;
use crate::session::{Session, Turn};
use crate::statistics::{Ended, Statistics};
use crate::timeline::{Latched, Timeline};

/// Longest sleep between two looks at signals and the server.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);

/// When to end and how fast to draw.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) frames: Option<u64>,
    pub(crate) duration: Option<Duration>,
    pub(crate) frame_time: Duration,
    /// Where pictures are written, and what their names begin with.
    pub(crate) out: Option<(PathBuf, String)>,
    /// From showing a picture to its light, in nanoseconds: where other nodes, with displays, show the same frame.
    pub(crate) display_ns: u64,
    pub(crate) show: Show,
    /// Name of the node.
    pub(crate) node: String,
}

/// Draws until the plan, the server or a signal ends it: the frames of the barrier, or each distinct state once.
pub(crate) fn run(
    session: &mut Session,
    canvas: &mut Canvas,
    timeline: &mut Timeline,
    statistics: &mut Statistics,
    plan: &Plan,
) -> Result<Ended, RenderError> {
    if let Some((folder, _)) = &plan.out {
        std::fs::create_dir_all(folder).map_err(|error| not_written(folder, &error))?;
    }
    let start = Instant::now();
    let mut drawing = Drawing {
        pacer: Pacer::new(session, plan.frame_time, plan.display_ns),
        session,
        canvas,
        timeline,
        statistics,
        plan,
        show: plan.show,
        next_frame: start,
        last_drawn: None,
    };
    loop {
        if let Some(ended) = drawing.keep_up()? {
            return Ok(ended);
        }
        if plan.duration.is_some_and(|most| start.elapsed() >= most) {
            return Ok(Ended::Duration);
        }
        drawing.report();
        let ended = match drawing.released() {
            // The barrier keeps the rhythm.
            Some((taken_ns, latched)) => drawing.draw_released(taken_ns, &latched)?,
            None => {
                let ended = drawing.draw_newest()?;
                if ended.is_none() {
                    drawing.rest();
                }
                ended
            }
        };
        if let Some(ended) = ended {
            return Ok(ended);
        }
    }
}

/// What tells a picture from the one before: the time of its state, ns, whether that is stale, and what is said of the link.
pub(crate) type Drawn = (u64, bool, Option<u64>);

/// Drawing under way.
struct Drawing<'a> {
    session: &'a mut Session,
    canvas: &'a mut Canvas,
    timeline: &'a mut Timeline,
    statistics: &'a mut Statistics,
    plan: &'a Plan,
    show: Show,
    pacer: Pacer,
    next_frame: Instant,
    last_drawn: Option<Drawn>,
}

impl Drawing<'_> {
    /// Follows signals and the server; why drawing has ended, if it has.
    fn keep_up(&mut self) -> Result<Option<Ended>, RenderError> {
        if self.session.interrupted() {
            return Ok(Some(Ended::Interrupted));
        }
        match self.session.turn(self.timeline) {
            Turn::Same => Ok(None),
            Turn::Renewed(other) => {
                self.statistics.renewed();
                if let Some(scene) = other {
                    self.canvas.restage(scene.0)?;
                    self.show = scene.1;
                }
                self.pacer = Pacer::new(self.session, self.plan.frame_time, self.plan.display_ns);
                self.last_drawn = None;
                Ok(None)
            }
            Turn::Told => Ok(Some(Ended::ServerStopped)),
            Turn::Lost(reason) => Err(self.session.lost(reason)),
        }
    }

    fn report(&mut self) {
        if let Some(stats) = self.statistics.report(false) {
            self.session.report(stats);
        }
    }

    /// The state that the barrier released, if it is time, and when it was taken, ns.
    fn released(&mut self) -> Option<(u64, Latched)> {
        self.session.take_states(self.timeline);
        let now_ns = self.session.now_ns()?;
        let latched = self.pacer.next(now_ns, self.timeline.newest_ns())?;
        let draws = self.pacer.draws_at(self.next_frame, self.plan.frame_time);
        draws.then_some((now_ns, latched))
    }

    /// Draws a frame of the barrier; why drawing has ended, if it has.
    fn draw_released(
        &mut self,
        taken_ns: u64,
        latched: &Latched,
    ) -> Result<Option<Ended>, RenderError> {
        let link = self.session.health();
        let status = self.statistics.status(&self.plan.node, link);
        self.canvas.set_status(self.pacer.complete(status));
        self.canvas
            .draw(latched, self.show, self.plan.out.is_some())?;
        self.pacer.wait();
        let late = self.pacer.shown();
        let shown_ns = self.session.now_ns().unwrap_or(taken_ns);
        self.statistics.frame(latched, taken_ns, shown_ns);
        self.statistics.swap(late);
        self.last_drawn = None;
        self.finish_frame(latched)
    }

    /// Without a barrier: each distinct state once, at this node's own rate. Why drawing has ended, if it has.
    fn draw_newest(&mut self) -> Result<Option<Ended>, RenderError> {
        let due = Instant::now() >= self.next_frame;
        let Some(taken_ns) = self.session.now_ns().filter(|_| due) else {
            return Ok(None);
        };
        let Some(mut latched) = self.timeline.latch(taken_ns) else {
            return Ok(None);
        };
        let link = self.session.health();
        let drawn = Some((latched.state.time_ns, latched.stale, shown(link)));
        if drawn == self.last_drawn && !self.session.is_picture_asked() {
            self.schedule();
            return Ok(None);
        }
        self.last_drawn = drawn;
        let status = self.statistics.status(&self.plan.node, link);
        self.canvas.set_status(status);
        // Off-screen a picture is looked at when it is done.
        latched.state.head = self.timeline.head_at(taken_ns).or(latched.state.head);
        self.canvas
            .draw(&latched, self.show, self.plan.out.is_some())?;
        let drawn_ns = self.session.now_ns().unwrap_or(taken_ns);
        self.statistics.frame(&latched, taken_ns, drawn_ns);
        self.finish_frame(&latched)
    }

    /// Hands on what is drawn; why drawing has ended, if it has.
    fn finish_frame(&mut self, latched: &Latched) -> Result<Option<Ended>, RenderError> {
        let (session, canvas) = (&mut *self.session, &*self.canvas);
        let eyes = eyes_of(canvas.stage(), latched);
        session.give_pictures(|shown_ns| canvas.frame(&eyes, shown_ns), || canvas.parts());
        session.tell_first_frame(|| (canvas.pictures(), canvas.gpu().summary().to_string()));
        let frames = self.statistics.frames;
        write_pictures(canvas, self.plan, frames)?;
        if self.plan.frames.is_some_and(|most| frames >= most) {
            return Ok(Some(Ended::Frames));
        }
        self.schedule();
        Ok(None)
    }

    /// A late frame does not hurry the next ones.
    fn schedule(&mut self) {
        self.next_frame = (self.next_frame + self.plan.frame_time).max(Instant::now());
    }

    fn rest(&self) {
        let left = self.next_frame.saturating_duration_since(Instant::now());
        // Nothing to draw yet: look again soon, but not at once.
        let rest = if left.is_zero() {
            Duration::from_millis(2)
        } else {
            left
        };
        std::thread::sleep(rest.min(LONGEST_SLEEP));
    }
}

/// What the screen says of the link, to the second: a picture is drawn again when that changes.
pub(crate) fn shown(link: LinkHealth) -> Option<u64> {
    match link {
        LinkHealth::Connected => None,
        LinkHealth::Rejoining => Some(u64::MAX), // no second of a loss: another text
        LinkHealth::Lost { since } => Some(since.as_secs()),
    }
}

/// Writes `NODE-SCREEN[-left|-right]-00001.png` and so on.
fn write_pictures(canvas: &Canvas, plan: &Plan, frame: u64) -> Result<(), RenderError> {
    let Some((folder, node)) = &plan.out else {
        return Ok(());
    };
    for (name, image) in canvas.images()? {
        let path = folder.join(picture_file(node, &format!("{name}-{frame:05}.png")));
        let saved = image.save(&path);
        saved.map_err(|error| not_written(&path, &error))?;
    }
    Ok(())
}

fn not_written(path: &Path, error: &dyn std::error::Error) -> RenderError {
    RenderError::Picture {
        path: path.to_path_buf(),
        reason: error.to_string(),
    }
}

/// The file of a node's `picture`. The first `-` ends the node's name, in which there is none, so that no two nodes write one file.
pub(crate) fn picture_file(node: &str, picture: &str) -> String {
    format!("{}-{}", plain(node).replace('-', "+2d"), plain(picture))
}

/// A file name without characters that a file system or a shell might take for something else: each byte of such a character is `+` and two
/// hexadecimal digits, so that no two names become one.
fn plain(name: &str) -> String {
    let keep = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.');
    let mut plain = String::with_capacity(name.len());
    for c in name.chars() {
        if keep(c) {
            plain.push(c);
        } else {
            let mut bytes = [0; 4];
            let bytes = c.encode_utf8(&mut bytes).bytes();
            plain.extend(bytes.map(|byte| format!("+{byte:02x}")));
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::{picture_file, plain};

    #[test]
    fn a_picture_stays_in_its_folder_whatever_its_screen_is_called() {
        assert_eq!(
            plain("left-../../wall 1-00001.png"),
            "left-..+2f..+2fwall+201-00001.png"
        );
    }

    #[test]
    fn pictures_of_two_nodes_never_have_one_name() {
        assert_eq!(
            picture_file("wall", "left-top-00001.png"),
            "wall-left-top-00001.png"
        );
        assert_eq!(
            picture_file("wall-left", "top-00001.png"),
            "wall+2dleft-top-00001.png"
        );
        assert_eq!(picture_file("wall+2dleft", "top"), "wall+2b2dleft-top");
    }

    #[test]
    fn pictures_of_two_screens_never_have_one_name() {
        let screens = [
            "a b",
            "a_b",
            "a/b",
            "a+b",
            "a+20b",
            "a\u{a0}b",
            "a\u{2014}b",
        ];
        let names: std::collections::BTreeSet<String> =
            screens.iter().map(|screen| plain(screen)).collect();
        assert_eq!(names.len(), screens.len(), "{names:?}");
        let safe = |c: char| c.is_alphanumeric() || "-_.+".contains(c);
        assert!(names.iter().all(|name| name.chars().all(safe)), "{names:?}");
    }
}
