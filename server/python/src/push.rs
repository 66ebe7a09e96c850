//! A force from outside for a session that runs elsewhere: what `taut push-wrench` does, from a program of one's own.

use std::future::ready;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use taut_link::{
    ClientLink, ClientOptions, LinkError, RejoinPolicy, Renewal, Role, SessionEnd, SupervisedLink,
    read_join_key,
};
use taut_proto::ForceSample;
use tokio::runtime::Runtime;

use crate::convert::{VectorLike, bad, row_of};

/// Names the key file where the caller names none, as for the program.
const KEY_VARIABLE: &str = "TAUT_KEY_FILE";
/// Most that a server takes for a force or torque, N or N m.
const LARGEST: f64 = 1e6;
/// Oldest value that is sent at all, s: nothing of it would be felt.
const OLDEST: f64 = 1.0;
/// Time for the clock to lock; a tenth of a second is usual.
const CLOCK_PATIENCE: Duration = Duration::from_secs(5);
const CLOCK_LOOK: Duration = Duration::from_millis(5);

/// A source of forces that is in a session.
#[pyclass(frozen, name = "push_wrench", module = "taut")]
pub(crate) struct PushWrench {
    #[pyo3(get)]
    server: String,
    /// That joined. A fork has a copy of its keys and counts, but no network: two that seal under the same numbers would give the keys away.
    process: u32,
    source: Mutex<Option<Source>>,
}

struct Source {
    supervised: SupervisedLink<()>,
    link: Arc<ClientLink>,
    /// Values sent.
    index: u64,
    /// Why there will be no session any more.
    ended: Option<String>,
    /// What the others run on: dropped last.
    runtime: Runtime,
}

#[pymethods]
impl PushWrench {
    #[new]
    #[pyo3(signature = (server, key = None, node = "force"))]
    fn new(py: Python<'_>, server: &str, key: Option<PathBuf>, node: &str) -> PyResult<Self> {
        let source = py.detach(|| Source::join(server, key, node)).map_err(bad)?;
        Ok(Self {
            server: server.to_owned(),
            process: std::process::id(),
            source: Mutex::new(Some(source)),
        })
    }

    #[pyo3(signature = (wrench, age = 0.0))]
    fn send(&self, wrench: VectorLike<'_>, age: f64) -> PyResult<bool> {
        let wrench = six(&wrench)?;
        if !(0.0..=OLDEST).contains(&age) {
            return Err(bad(format!(
                "the age of a wrench is {age} s; give the time since it was measured, 0 to {OLDEST} s"
            )));
        }
        if self.is_forked() {
            return Err(bad(
                "this source of forces was made in another process, which a fork cannot speak for; make one after the fork",
            ));
        }
        match &mut *self.lock() {
            Some(source) => source.send(wrench, Duration::from_secs_f64(age), &self.server),
            None => Err("this source of forces was closed; make another".to_owned()),
        }
        .map_err(bad)
    }

    /// Values sent so far.
    #[getter]
    fn sent(&self) -> u64 {
        self.lock().as_ref().map_or(0, |source| source.index)
    }

    fn close(&self, py: Python<'_>) {
        let source = self.lock().take();
        match source {
            Some(source) if self.is_forked() => std::mem::forget(source),
            Some(source) => py.detach(|| source.leave()),
            None => {}
        }
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, pyo3::types::PyTuple>) {
        self.close(py);
    }
}

impl PushWrench {
    /// Held for moments, and never while the interpreter's lock is waited for.
    fn lock(&self) -> MutexGuard<'_, Option<Source>> {
        self.source.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_forked(&self) -> bool {
        self.process != std::process::id()
    }
}

impl Drop for PushWrench {
    fn drop(&mut self) {
        if self.is_forked() {
            // Its threads are the parent's: whoever ended it here would wait for them for ever.
            let source = self.source.get_mut();
            std::mem::forget(source.unwrap_or_else(PoisonError::into_inner).take());
        }
    }
}

impl Source {
    /// Joins, and waits until it knows session time: a value without a time is felt by nobody.
    fn join(server: &str, key: Option<PathBuf>, node: &str) -> Result<Self, String> {
        let named = key.or_else(|| std::env::var_os(KEY_VARIABLE).map(PathBuf::from));
        let file = named.filter(|file| !file.as_os_str().is_empty()).ok_or_else(|| {
            format!("no credential is named: give the force source's, which `taut keys` made on the haptic PC, as `key` or by {KEY_VARIABLE}")
        })?;
        let key = read_join_key(&file).map_err(|error| error.to_string())?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("taut-force")
            .enable_all()
            .build()
            .map_err(|error| format!("the network's thread cannot be started ({error})"))?;
        let options = ClientOptions::new(server, key, Role::Force, node);
        let joining = SupervisedLink::join(options, RejoinPolicy::default(), |_| {
            ready(Ok::<(), LinkError>(()))
        });
        let (supervised, link, ()) = runtime
            .block_on(joining)
            .map_err(|error| error.to_string())?;
        let source = Self {
            supervised,
            link,
            index: 0,
            ended: None,
            runtime,
        };
        let begun = Instant::now();
        while source.link.session_now().is_none() {
            if begun.elapsed() > CLOCK_PATIENCE {
                return Err(format!(
                    "{server} does not say what time it is: does the firewall let UDP through, port 4858 by default?"
                ));
            }
            std::thread::sleep(CLOCK_LOOK);
        }
        Ok(source)
    }

    /// Whether it went out; not while the server is away.
    fn send(&mut self, wrench: [f64; 6], age: Duration, server: &str) -> Result<bool, String> {
        match self.supervised.take_renewal() {
            None => {}
            Some(Renewal::Session { link, .. }) => self.link = link,
            Some(Renewal::Ended(SessionEnd::ServerStopped)) => {
                self.ended = Some(format!("the server at {server} stopped"));
            }
            Some(Renewal::Ended(SessionEnd::Lost(why))) => {
                self.ended = Some(format!("the server at {server} was lost: {why}"));
            }
        }
        if let Some(ended) = &self.ended {
            return Err(ended.clone());
        }
        let open = self.link.is_closed().is_none();
        let Some(now) = self.link.session_now().filter(|_| open) else {
            return Ok(false);
        };
        let age_ns = u64::try_from(age.as_nanos()).unwrap_or(u64::MAX);
        self.index += 1;
        self.link.send_force(&ForceSample {
            sample_time_ns: now.ns.saturating_sub(age_ns),
            clock_uncertainty_ns: now.uncertainty_ns,
            index: self.index,
            wrench,
        });
        Ok(true)
    }

    fn leave(self) {
        let Self {
            supervised,
            link,
            runtime,
            ..
        } = self;
        // Nobody is to join again for the session that is left here.
        drop(supervised);
        runtime.block_on(link.leave());
    }
}

/// Six numbers that a server takes.
fn six(wrench: &VectorLike<'_>) -> PyResult<[f64; 6]> {
    match row_of::<6>(wrench) {
        // Not so for NaN.
        Ok(six) if six.iter().all(|x| x.abs() <= LARGEST) => Ok(six),
        _ => Err(bad(format!(
            "{} is no wrench: give six numbers from -10^6 to 10^6, force x y z in N, then torque x y z in N m",
            wrench.as_array()
        ))),
    }
}
