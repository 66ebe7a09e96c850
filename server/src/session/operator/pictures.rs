//! Pictures of what the render nodes show, for the operator's page: asked for one lot at a time, checked, and kept until the next lot.

use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::Builder;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::Serialize;
use taut_link::{NodePicture, PictureAnswer, PictureAsker};
use taut_observers::{Answer, Outcome};

use super::picture_check::check;
use crate::shared::lock::lock;

/// Shortest time from one asking to the next: the nodes draw a frame more for each.
const SHORTEST_PERIOD: Duration = Duration::from_secs(2);

/// A picture that was found to be one.
#[derive(Debug)]
struct Kept {
    number: u64,
    png: Arc<[u8]>,
}

/// The list that is told.
#[derive(Debug, Default, Serialize)]
struct Lot {
    pictures: Vec<Told>,
    problems: Vec<Problem>,
}

#[derive(Debug, Serialize)]
struct Told {
    /// `/picture/NUMBER` has it.
    number: u64,
    node: String,
    screen: String,
    /// When it was shown, seconds since 1970.
    shown_at: f64,
    width: u16,
    height: u16,
    bytes: usize,
}

/// A node, or one of its pictures, that is not there.
#[derive(Debug, Serialize)]
struct Problem {
    node: String,
    why: String,
}

#[derive(Debug, Default)]
struct State {
    /// Of the session that runs.
    asker: Option<PictureAsker>,
    asked_at: Option<Instant>,
    is_busy: bool,
    next_number: u64,
    kept: Vec<Kept>,
}

/// Where the page asks.
#[derive(Clone, Debug, Default)]
pub(super) struct PictureDesk(Arc<Mutex<State>>);

impl PictureDesk {
    /// Asks the nodes of this session from now on; `None`: there is none.
    pub(super) fn follow(&self, asker: Option<PictureAsker>) {
        self.lock().asker = asker;
    }

    /// Asks all nodes.
    ///
    /// # Errors
    /// A sentence: why they are not asked now.
    pub(super) fn ask(&self) -> Result<Outcome, String> {
        let mut state = self.lock();
        if state.is_busy {
            return Err("not asked: the nodes are just being asked; wait for their answers".into());
        }
        let now = Instant::now();
        let early = state.asked_at.map_or(Duration::ZERO, |at| {
            SHORTEST_PERIOD.saturating_sub(now.saturating_duration_since(at))
        });
        if !early.is_zero() {
            let seconds = early.as_secs_f64();
            return Err(format!(
                "not asked: it is too soon after the last time; ask again in {seconds:.1} s"
            ));
        }
        let Some(asker) = &state.asker else {
            return Err("not asked: the scene is being changed; ask again in a moment".into());
        };
        let answers = asker.ask();
        let answer = Arc::<Mutex<Option<Answer>>>::default();
        let (desk, told) = (self.clone(), answer.clone());
        let collect = move || {
            let _busy = Busy(desk.clone());
            let lot = desk.collect(&answers);
            let text = serde_json::to_string(&lot).map_err(|error| error.to_string());
            *lock(&told) = Some(text);
        };
        Builder::new()
            .name("pictures".to_owned())
            .spawn(collect)
            .map_err(|error| format!("not asked: no thread for the answers ({error})"))?;
        (state.is_busy, state.asked_at) = (true, Some(now));
        Ok(Box::new(move || lock(&answer).take()))
    }

    /// The picture of this number, if it is of the newest lot.
    pub(super) fn picture(&self, number: u64) -> Option<Arc<[u8]>> {
        let state = self.lock();
        let kept = state.kept.iter().find(|kept| kept.number == number)?;
        Some(kept.png.clone())
    }

    /// Takes the answers, until all are there; they take the place of those before. The link bounds their number, size and time.
    fn collect(&self, answers: &Receiver<PictureAnswer>) -> Lot {
        let (mut lot, mut kept) = (Lot::default(), Vec::new());
        let mut number = self.lock().next_number;
        for PictureAnswer { node, pictures } in answers {
            match pictures {
                Ok(pictures) => {
                    for picture in pictures {
                        match self::take(&node, picture, number) {
                            Ok((told, png)) => {
                                lot.pictures.push(told);
                                kept.push(Kept { number, png });
                                number += 1;
                            }
                            Err(problem) => lot.problems.push(problem),
                        }
                    }
                }
                Err(why) => lot.problems.push(Problem { node, why }),
            }
        }
        // In the order of the names, whoever answers first.
        let by = |told: &Told| (told.node.clone(), told.screen.clone());
        lot.pictures.sort_by_key(by);
        lot.problems.sort_by(|a, b| a.node.cmp(&b.node));
        let mut state = self.lock();
        (state.next_number, state.kept) = (number, kept);
        lot
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.0)
    }
}

/// While answers are taken; a picture over which a decoder breaks down keeps nobody from asking again.
struct Busy(PictureDesk);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.lock().is_busy = false;
    }
}

/// What is told and kept of a picture, once it is found to be one.
fn take(node: &str, picture: NodePicture, number: u64) -> Result<(Told, Arc<[u8]>), Problem> {
    let screen = picture.screen.to_string();
    check(&picture.png, picture.size).map_err(|why| Problem {
        node: node.to_owned(),
        why: format!("its picture of {screen} is refused: {why}"),
    })?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let shown = now.unwrap_or_default().saturating_sub(picture.age);
    let (width, height) = picture.size;
    let told = Told {
        number,
        node: node.to_owned(),
        screen,
        shown_at: shown.as_secs_f64(),
        width,
        height,
        bytes: picture.png.len(),
    };
    Ok((told, picture.png.into()))
}

#[cfg(test)]
mod tests {
    use super::super::picture_check::tests::png_of;
    use super::*;
    use std::sync::mpsc::channel;

    fn answer(node: &str, pictures: Result<Vec<NodePicture>, String>) -> PictureAnswer {
        PictureAnswer {
            node: node.to_owned(),
            pictures,
        }
    }

    fn picture(screen: &str, png: Vec<u8>) -> NodePicture {
        NodePicture {
            screen: screen.into(),
            age: Duration::from_millis(30),
            size: (8, 4),
            png,
        }
    }

    #[test]
    fn a_lot_tells_pictures_and_names_what_is_missing_and_the_next_takes_its_place() {
        let desk = PictureDesk::default();
        let (send, answers) = channel();
        let good = png_of(8, 4);
        send.send(answer("table", Err("it did not answer".to_owned())))
            .expect("open");
        let pictures = vec![
            picture("wall-right", good.clone()),
            picture("wall-left", good.clone()),
            picture("wall", b"GIF89a".to_vec()),
        ];
        send.send(answer("front", Ok(pictures))).expect("open");
        drop(send);
        let lot = desk.collect(&answers);
        let told: Vec<_> = lot
            .pictures
            .iter()
            .map(|t| (&*t.screen, t.number))
            .collect();
        assert_eq!(told, [("wall-left", 1), ("wall-right", 0)]);
        assert!(lot.pictures.iter().all(|told| told.shown_at > 1.7e9));
        let problems: Vec<_> = lot.problems.iter().map(|p| (&*p.node, &*p.why)).collect();
        assert_eq!(problems[1], ("table", "it did not answer"));
        assert_eq!(problems[0].0, "front");
        assert!(
            problems[0].1.contains("wall is refused"),
            "{}",
            problems[0].1
        );
        assert_eq!(desk.picture(1).as_deref(), Some(&*good));
        assert_eq!(desk.picture(2), None);
        let (nobody, answers) = channel();
        drop(nobody);
        let lot = desk.collect(&answers);
        assert!(lot.pictures.is_empty() && desk.picture(1).is_none());
    }

    #[test]
    fn between_two_sessions_nobody_is_asked() {
        let desk = PictureDesk::default();
        let why = desk.ask().err().expect("nobody there");
        assert!(why.contains("ask again in a moment"), "{why}");
    }
}
