//! Draws without a window: to PNG files, or to nowhere to see how a node keeps up.

use std::path::PathBuf;
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
        std::fs::create_dir_all(folder).map_err(|error| RenderError::Picture {
            path: folder.clone(),
            reason: error.to_string(),
        })?;
    }
    let start = Instant::now();
    let mut next_frame = start;
    let mut last_drawn = None;
    let mut pacer = Pacer::new(session, plan.frame_time, plan.display_ns);
    let mut show = plan.show;
    loop {
        if session.interrupted() {
            return Ok(Ended::Interrupted);
        }
        match session.turn(timeline) {
            Turn::Same => {}
            Turn::Renewed(other) => {
                statistics.renewed();
                if let Some(scene) = other {
                    canvas.restage(scene.0)?;
                    show = scene.1;
                }
                pacer = Pacer::new(session, plan.frame_time, plan.display_ns);
                last_drawn = None;
            }
            Turn::Told => return Ok(Ended::ServerStopped),
            Turn::Lost(reason) => return Err(session.lost(reason)),
        }
        let link = session.health();
        if plan
            .duration
            .is_some_and(|duration| start.elapsed() >= duration)
        {
            return Ok(Ended::Duration);
        }
        if let Some(stats) = statistics.report(false) {
            session.report(stats);
        }

        session.take_states(timeline);
        let now_ns = session.now_ns();
        let released =
            now_ns.and_then(|now_ns| Some((now_ns, pacer.next(now_ns, timeline.newest_ns())?)));
        if let Some((taken_ns, latched)) =
            released.filter(|_| pacer.draws_at(next_frame, plan.frame_time))
        {
            canvas.set_status(pacer.complete(statistics.status(&plan.node, link)));
            canvas.draw(&latched, show, plan.out.is_some())?;
            pacer.wait();
            let late = pacer.shown();
            let shown_ns = session.now_ns().unwrap_or(taken_ns);
            statistics.frame(&latched, taken_ns, shown_ns);
            statistics.swap(late);
            show_server(session, canvas, &latched);
            tell(session, canvas);
            if finish(canvas, statistics, plan)? {
                return Ok(Ended::Frames);
            }
            last_drawn = None;
            next_frame = (next_frame + plan.frame_time).max(Instant::now());
            continue; // the barrier keeps the rhythm
        }

        // No barrier: each distinct state once, at this node's own rate.
        let due = Instant::now() >= next_frame;
        let latched = now_ns
            .filter(|_| due)
            .and_then(|now_ns| Some((now_ns, timeline.latch(now_ns)?)));
        if let Some((taken_ns, mut latched)) = latched {
            let drawn = Some((latched.state.time_ns, latched.stale, shown(link)));
            if drawn != last_drawn || session.is_picture_asked() {
                last_drawn = drawn;
                canvas.set_status(statistics.status(&plan.node, link));
                // Off-screen a picture is looked at when it is done.
                latched.state.head = timeline.head_at(taken_ns).or(latched.state.head);
                canvas.draw(&latched, show, plan.out.is_some())?;
                let drawn_ns = session.now_ns().unwrap_or(taken_ns);
                statistics.frame(&latched, taken_ns, drawn_ns);
                show_server(session, canvas, &latched);
                tell(session, canvas);
                if finish(canvas, statistics, plan)? {
                    return Ok(Ended::Frames);
                }
            }
            // A late frame does not hurry the next ones.
            next_frame = (next_frame + plan.frame_time).max(Instant::now());
        }
        let left = next_frame.saturating_duration_since(Instant::now());
        // Nothing to draw yet: look again soon, but not at once.
        let rest = if left.is_zero() {
            Duration::from_millis(2)
        } else {
            left
        };
        std::thread::sleep(rest.min(LONGEST_SLEEP));
    }
}

/// Gives the server the pictures of this frame, if it wants them.
fn show_server(session: &Session, canvas: &Canvas, latched: &Latched) {
    let eyes = eyes_of(canvas.stage(), latched);
    session.give_pictures(|shown_ns| canvas.frame(&eyes, shown_ns), || canvas.parts());
}

fn tell(session: &mut Session, canvas: &Canvas) {
    session.tell_first_frame(|| (canvas.pictures(), canvas.gpu().summary().to_string()));
}

/// Writes the frame's pictures; whether it was the last.
fn finish(canvas: &Canvas, statistics: &Statistics, plan: &Plan) -> Result<bool, RenderError> {
    write_pictures(canvas, plan, statistics.frames)?;
    let enough = |frames| statistics.frames >= frames;
    Ok(plan.frames.is_some_and(enough))
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
        image.save(&path).map_err(|error| RenderError::Picture {
            path: path.clone(),
            reason: error.to_string(),
        })?;
    }
    Ok(())
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
