//! The thread on a device's wire, one mechanism for every driver that has one: the newest state out, the newest command in, and the device
//! opened again when it is gone.
//!
//! | thread       | does                                                                                          |
//! |--------------|-----------------------------------------------------------------------------------------------|
//! | the driver's | sockets, ports, libraries: [`Wire::session`], again and again until the end                     |
//! | the device's | [`WireThread::newest`], [`WireThread::command`]: no lock, no system call, no allocation            |
//!
//! No command outlives its reason: from [`HOLDS`] after the last write of the device's loop on [`Line::command`] has none, and a session's last
//! word is zero. A driver that has let go, or begins a session anew, renders nothing until the device's loop knows of it
//! once more ([`WireThread::let_go`]): the next command was made for a hand that feels the last one, and would be a blow. The same holds where the
//! driver's own thread has stalled for longer than [`HOLDS`]: the device's watchdog has let go in its place.

use std::fmt::Display;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use super::pace::Pace;
use super::{ArmPort, ArmState};
use crate::own_thread::ThreadError;
use crate::realtime::{self, Ticker, monotonic_now};

/// From the last write of the device's loop on nothing is commanded any more; and a device that hears nothing for longer may have ended the force.
pub(crate) const HOLDS: Duration = Duration::from_millis(20);
/// From message to message of a driver, which keeps the time itself: [`ticker`].
pub(crate) const PERIOD: Duration = Duration::from_millis(1);
/// Where in the period a message goes out: just after the device's loop, whose command it carries.
pub(crate) const PHASE: Duration = Duration::from_micros(350);
/// Between two sessions.
const RETRY: Duration = Duration::from_millis(200);
/// A device that was there for longer and is gone is told of again.
const HELD_ON: Duration = Duration::from_secs(1);
/// For the last word. A driver that hangs longer is left to itself.
const CLOSE_WITHIN: Duration = Duration::from_secs(2);
/// How often a thread that waits for an end looks for it.
const LOOK: Duration = Duration::from_millis(1);

/// A driver's side of the thread.
pub(crate) trait Wire: Send + 'static {
    /// What the device says.
    type State: WireState;
    /// What it is commanded.
    type Command: Copy + Default + Send + 'static;
    /// Why a session ended before the end.
    type Lost: Display;

    /// For people, with its place: "the Polhem board on /dev/ttyUSB0".
    fn name(&self) -> String;

    /// Whether a state answers each command: then how long that takes is reported.
    fn answers(&self) -> bool {
        true
    }

    /// Opens the device and exchanges commands for states until [`Line::is_over`], or until it is lost; at either end zero is the last word.
    fn session(&mut self, line: &mut Line<Self::State, Self::Command>) -> Result<(), Self::Lost>;
}

/// A state that says whether the device is there.
pub(crate) trait WireState: Copy + Default + Send + 'static {
    fn lose(&mut self);
}

impl WireState for ArmState {
    fn lose(&mut self) {
        self.is_usable = false;
    }
}

/// A command, how many were written before it, and how often the driver had let go as far as who wrote it knew.
#[derive(Clone, Copy, Debug, Default)]
struct Written<C> {
    writes: u64,
    let_go: u64,
    command: C,
}

/// The driver's end of the exchange.
pub(crate) struct Line<S: Send, C: Send> {
    /// What was said last; handed on by [`Self::publish`].
    pub(crate) state: S,
    out: triple_buffer::Input<S>,
    wanted: triple_buffer::Output<Written<C>>,
    /// Writes of the device's loop, and when the last was seen.
    seen: (u64, Duration),
    /// When the driver asked for a command last; long ago where nobody rendered what it was given.
    called: Option<Duration>,
    /// Of this session, where a state answers each command.
    pace: Option<Pace>,
    /// When the command was taken that the next state answers.
    asked: Option<Duration>,
    /// How often the driver has let go, and whether it has rendered a command since.
    let_go: Arc<AtomicU64>,
    renders: bool,
    end: Arc<AtomicBool>,
}

impl<S: WireState, C: Copy + Send> Line<S, C> {
    /// Whether the device's loop has done with the device.
    pub(crate) fn is_over(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// What [`Self::is_over`] looks at, for who waits elsewhere.
    pub(crate) fn end(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.end)
    }

    pub(crate) fn publish(&mut self) {
        self.out.write(self.state);
        if let Some(pace) = &mut self.pace {
            pace.read();
            if let Some(asked) = self.asked.take() {
                pace.cycle(asked);
            }
        }
    }

    /// What is commanded at `now`; `None` where nobody has written within [`HOLDS`], or not since the driver let go.
    pub(crate) fn command(&mut self, now: Duration) -> Option<C> {
        self.command_if(now, true)
    }

    /// The same for a driver that can render only while `can_render`; it lets go where it cannot.
    pub(crate) fn command_if(&mut self, now: Duration, can_render: bool) -> Option<C> {
        self.asked = Some(now);
        let called = self.called.replace(now).unwrap_or(now);
        // Nobody has rendered what was commanded until now, whatever the device's loop was told before: it is told once more.
        let missed = now.saturating_sub(called) > HOLDS || !can_render;
        self.renders |= missed;
        let wanted = *self.wanted.read();
        if wanted.writes != self.seen.0 {
            self.seen = (wanted.writes, now);
        }
        let is_fresh = wanted.writes > 0 && now.saturating_sub(self.seen.1) < HOLDS;
        if !is_fresh || missed {
            self.let_go();
            return None;
        }
        let knows = wanted.let_go == self.let_go.load(Ordering::Acquire);
        self.renders |= knows;
        knows.then_some(wanted.command)
    }

    /// Whether what was commanded last is too old to be written at `now`: the driver's thread has stalled since it took it.
    pub(crate) fn is_late(&self, now: Duration) -> bool {
        self.called
            .is_some_and(|called| now.saturating_sub(called) > HOLDS)
    }

    /// The device has had zero for a while, whatever was commanded: the next command is none, and the port begins at zero.
    pub(crate) fn missed(&mut self) {
        self.called = Some(Duration::ZERO);
    }

    /// There is no force on the hand, though one was commanded.
    pub(crate) fn let_go(&mut self) {
        if std::mem::take(&mut self.renders) {
            self.let_go.fetch_add(1, Ordering::AcqRel);
        }
    }
}

/// The end of a driver of an arm with three motors: a force in the arm's own axes, N.
pub(crate) type ArmLine = Line<ArmState, [f64; 3]>;
/// An arm with three motors under a thread of its own.
pub(crate) type ArmThread = WireThread<ArmState, [f64; 3]>;

/// A device under a thread of its own. Dropping it ends the thread, whose last word is zero.
pub(crate) struct WireThread<S: Send, C: Send> {
    newest: triple_buffer::Output<S>,
    wanted: triple_buffer::Input<Written<C>>,
    next: Written<C>,
    let_go: Arc<AtomicU64>,
    name: String,
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl<S: WireState, C: Copy + Default + Send + 'static> WireThread<S, C> {
    /// Both ends, without a thread.
    fn ends(name: String) -> (Self, Line<S, C>) {
        let (out, newest) = triple_buffer::TripleBuffer::new(&S::default()).split();
        let (wanted, taken) = triple_buffer::TripleBuffer::new(&Written::default()).split();
        let end = Arc::new(AtomicBool::new(false));
        let let_go = Arc::new(AtomicU64::new(0));
        let line = Line {
            state: S::default(),
            out,
            wanted: taken,
            seen: (0, Duration::ZERO),
            called: None,
            pace: None,
            asked: None,
            let_go: Arc::clone(&let_go),
            renders: false,
            end: Arc::clone(&end),
        };
        let port = Self {
            newest,
            wanted,
            next: Written::default(),
            let_go,
            name,
            end,
            thread: None,
        };
        (port, line)
    }

    /// Runs `wire` in a thread called `thread`, which is for `what`. `priority` asks for real time, 0 does not.
    ///
    /// # Errors
    /// The system has no thread.
    pub(crate) fn start<W>(
        thread: &str,
        what: &'static str,
        priority: u8,
        wire: W,
    ) -> Result<Self, ThreadError>
    where
        W: Wire<State = S, Command = C>,
    {
        let (mut port, line) = Self::ends(wire.name());
        let thread = thread::Builder::new()
            .name(thread.to_owned())
            .spawn(move || {
                ask_for_real_time(priority, &wire.name());
                run(wire, line);
            })
            .map_err(|cause| ThreadError(what, cause.to_string()))?;
        port.thread = Some(thread);
        Ok(port)
    }

    pub(crate) fn newest(&mut self) -> &S {
        self.newest.read()
    }

    /// Wants `command` until the next call, but for no longer than [`HOLDS`].
    pub(crate) fn command(&mut self, command: C) {
        self.next = Written {
            writes: self.next.writes + 1,
            command,
            ..self.next
        };
        self.wanted.write(self.next);
    }

    /// Whether the driver has let go since this was asked last. Until then it renders no command.
    pub(crate) fn let_go(&mut self) -> bool {
        let let_go = self.let_go.load(Ordering::Acquire);
        std::mem::replace(&mut self.next.let_go, let_go) != let_go
    }
}

impl<S: Send, C: Send> Drop for WireThread<S, C> {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        let Some(thread) = self.thread.take() else {
            return;
        };
        let until = monotonic_now() + CLOSE_WITHIN;
        while !thread.is_finished() {
            if monotonic_now() > until {
                tracing::error!(
                    "{} hangs and cannot be closed: switch the device off, it may still push",
                    self.name
                );
                return;
            }
            thread::sleep(LOOK);
        }
        let _ = thread.join(); // if it broke down, its wire went with it, and the force with that
    }
}

impl ArmPort for ArmThread {
    fn newest(&mut self) -> ArmState {
        *self.newest()
    }

    fn push(&mut self, force: [f64; 3]) {
        self.command(force);
    }

    fn let_go(&mut self) -> bool {
        self.let_go()
    }
}

/// For the messages of a session.
pub(crate) fn ticker() -> Ticker {
    Ticker::at_phase(PERIOD, PHASE)
}

/// Asks for real time for this thread, unless `priority` is 0, and tells where it is refused.
pub(crate) fn ask_for_real_time(priority: u8, name: &str) {
    if priority > 0 {
        let grant = realtime::request_fifo(priority);
        if !grant.is_granted() {
            tracing::warn!("{grant}: what is said to {name} may be late");
        }
    }
}

fn run<W: Wire>(mut wire: W, mut line: Line<W::State, W::Command>) {
    let mut last_lost = String::new();
    while !line.is_over() {
        let begun = monotonic_now();
        line.pace = wire.answers().then(|| Pace::new(&wire.name()));
        line.asked = None;
        let ended = wire.session(&mut line);
        line.pace = None; // it reports
        let Err(lost) = ended else {
            return;
        };
        line.let_go();
        line.state.lose();
        line.publish();
        // One that is lost at once, again and again, is told once.
        let held_on = monotonic_now().saturating_sub(begun) > HELD_ON;
        let lost = lost.to_string();
        if lost != last_lost || held_on {
            tracing::warn!("{} is gone: {lost}; looking for it", wire.name());
            last_lost = lost;
        }
        if !line.is_over() {
            thread::sleep(RETRY); // longer than HOLDS: what was commanded meanwhile nobody rendered
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;
    use crate::ms;

    /// Tells every command that it is given, and is lost once.
    struct Scripted {
        commands: Sender<Option<f64>>,
        lost: bool,
    }

    impl WireState for u32 {
        fn lose(&mut self) {
            *self = u32::MAX;
        }
    }

    impl Wire for Scripted {
        type State = u32;
        type Command = f64;
        type Lost = &'static str;

        fn name(&self) -> String {
            "the scripted wire".to_owned()
        }

        fn session(&mut self, line: &mut Line<u32, f64>) -> Result<(), &'static str> {
            while !line.is_over() {
                let command = line.command(monotonic_now());
                let _ = self.commands.send(command);
                if command == Some(-1.0) && !std::mem::replace(&mut self.lost, true) {
                    return Err("told to");
                }
                line.state = 1;
                line.publish();
                thread::sleep(LOOK);
            }
            let _ = self.commands.send(Some(0.0));
            Ok(())
        }
    }

    fn started() -> (WireThread<u32, f64>, Receiver<Option<f64>>) {
        let (commands, said) = channel();
        let wire = Scripted {
            commands,
            lost: false,
        };
        let thread = WireThread::start("scripted", "a test", 0, wire).expect("a thread");
        (thread, said)
    }

    /// Commands `wanted` until it is said: a thread of a busy machine that stands for long lets go.
    fn say(thread: &mut WireThread<u32, f64>, said: &Receiver<Option<f64>>, wanted: f64) {
        loop {
            thread.let_go();
            thread.command(wanted);
            if said.recv_timeout(Duration::from_secs(60)).expect("said") == Some(wanted) {
                return;
            }
        }
    }

    /// What is said at the millisecond that each is given with.
    fn says(line: &mut Line<u32, f64>, said: &[(u64, Option<f64>)]) {
        for (time, wanted) in said {
            assert_eq!(line.command(ms(*time)), *wanted, "at {time} ms");
        }
    }

    #[test]
    fn a_command_is_not_held_when_nobody_writes_any_more() {
        let (mut port, mut line) = WireThread::<u32, f64>::ends("a wire".to_owned());
        says(&mut line, &[(0, None)]);
        port.command(2.0);
        says(
            &mut line,
            &[(1, Some(2.0)), (11, Some(2.0)), (20, Some(2.0)), (21, None)],
        );
    }

    #[test]
    fn a_lost_device_is_not_there_until_it_is_opened_again() {
        let (mut thread, said) = started();
        say(&mut thread, &said, -1.0);
        while *thread.newest() != u32::MAX {
            thread::sleep(LOOK);
        }
        while *thread.newest() != 1 {
            thread::sleep(LOOK);
        }
    }

    #[test]
    fn a_driver_that_has_let_go_renders_nothing_until_that_is_known() {
        let (mut port, mut line) = WireThread::<u32, f64>::ends("a wire".to_owned());
        says(&mut line, &[(0, None)]);
        assert!(!port.let_go(), "nothing was rendered yet");
        port.command(2.0);
        says(&mut line, &[(1, Some(2.0)), (15, Some(2.0)), (30, None)]);
        // Made for a hand that feels the 2.
        for time in 31..36 {
            port.command(1.9);
            says(&mut line, &[(time, None)]);
        }
        assert!(port.let_go());
        port.command(0.5);
        says(&mut line, &[(36, Some(0.5))]);
        assert!(!port.let_go());
    }

    #[test]
    fn a_driver_that_stalled_for_longer_than_a_watchdog_waits_has_let_go() {
        let (mut port, mut line) = WireThread::<u32, f64>::ends("a wire".to_owned());
        port.command(2.0);
        says(&mut line, &[(100, Some(2.0))]);
        // The device's loop goes on meanwhile.
        for time in [120, 141] {
            port.command(2.0);
            says(&mut line, &[(time, (time == 120).then_some(2.0))]);
        }
        port.command(2.0);
        says(&mut line, &[(142, None)]);
        assert!(port.let_go());
        port.command(0.5);
        says(&mut line, &[(143, Some(0.5))]);
    }

    #[test]
    fn a_command_that_a_stalled_driver_took_long_ago_is_not_written() {
        let (mut port, mut line) = WireThread::<u32, f64>::ends("a wire".to_owned());
        assert!(!line.is_late(ms(50)), "nothing was taken");
        port.command(2.0);
        says(&mut line, &[(100, Some(2.0))]);
        assert!(!line.is_late(ms(120)) && line.is_late(ms(121)));
        line.missed();
        port.command(2.0);
        says(&mut line, &[(122, None)]);
        assert!(port.let_go());
    }

    #[test]
    fn zero_is_the_last_word() {
        let (mut thread, said) = started();
        say(&mut thread, &said, 3.0);
        drop(thread);
        assert_eq!(said.iter().last(), Some(Some(0.0)));
    }
}
