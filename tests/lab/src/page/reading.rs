//! What a reader has to know: the methods, the unit of error, the times, and how to put another method beside these.

use std::fmt::Write as _;

use super::escaped;
use crate::costs;
use crate::method::Method;

/// What a method is, in a line.
fn about(method: Method) -> &'static str {
    match method {
        Method::Ours => {
            "this project's god-object method, its look-ahead fitted to the speed of the device and the rate of updates"
        }
        Method::OursByDefault => {
            "the same with its default settings, which know the size of the body alone"
        }
        Method::Paper => {
            "Ortega, Redon, Coquillart 2007, to the letter: a cone of touching contacts, one projection and one continuous search in an update, k_s = 0.5"
        }
        Method::PaperAdapted => {
            "the same with the paper's adaptation of constraints: new ones are let in over a time"
        }
        Method::VirtualCoupling => "spring and damper to a dynamic proxy that contacts hold",
        Method::Discrete => "a god-object that looks for collisions only where a step ends",
        Method::Penalty => {
            "points of the body pushed out of a signed distance, as in voxel sampling"
        }
        Method::StaticCoupling => {
            "Barbic and James 2008 for rigid bodies: a nested point shell in distance fields, where its penalty balances with a saturating spring to the device"
        }
        Method::LinearisedPenalty => {
            "Otaduy and Lin 2006: a light dynamic tool on a spring and damper, integrated implicitly for each force against contacts that are linearised at each update"
        }
        Method::TwoRateLcp => {
            "Duriez et al. 2006, Saupin et al. 2008, as in SOFA: a complementarity problem of contacts by proximity, solved again for each force"
        }
        Method::DoesNothing | Method::RandomForce => {
            "a control: its body never moves, and its force is none or random; it must fail every recipe"
        }
        Method::Point => {
            "Zilles and Salisbury 1995: the body moves, held by up to three planes, and never turns"
        }
    }
}

/// The section of the page.
pub(super) fn section(page: &mut String) -> std::fmt::Result {
    page.push_str(
        "<h2 id=reading>How to read this page</h2>\n<details><summary>Methods</summary><table>\n",
    );
    for method in Method::ALL {
        let count = method.tunings().len();
        let tuned = if count > 1 {
            format!(
                "the best of {count} tunings in each case and at each rate, by start phases that judge nothing: trials.csv"
            )
        } else {
            "nothing is tuned".to_owned()
        };
        writeln!(
            page,
            "<tr><th>{}<td>{}<td>{tuned}",
            method.name(),
            escaped(about(method))
        )?;
    }
    page.push_str(
        "</table></details>\n<details><summary>Error felt, J</summary><p>Of a millisecond, the largest of its errors against the right answer, each over what people \
         just notice: angle of the force over 18.4 degrees (Barbagli et al. 2006), its magnitude over 7 % of the larger, at least 0.1 N (Pang, Tan, Durlach 1991), \
         torque over 12.7 % of the larger, at least 0.1 N at the radius of the body (Jandura, Srinivasan 1994), a change beyond the right one over 7 % of the \
         force, at least 0.1 N, a force where there should be none or none where there should be one over 0.1 N, and ripple between 30 and 500 Hz over 30 mN. J of a \
         case is the 95th percentile of its milliseconds; of the start phases the worst counts. The right answer is a closed form, or a run of this \
         project's method with fine steps that says how far it is from its own limit. J &lt; 1 is not felt. Sweeps have the first version of J: the largest of the 95th percentiles of angle, magnitude and torque, \
         and of the largest change.</p></details>\n",
    );
    writeln!(
        page,
        "<details><summary>Times</summary><p>The clock of the recipes is virtual: an update is there when it is done, after a time that is drawn from a committed \
         table ({}), so that accuracy does not depend on the machine that runs this. One that takes longer than a period delays the next. In sweeps and stability maps, \
         and where the table has no row, each takes a whole period. Microseconds beside an outcome are CPU time of one thread in this run, 99th percentile over \
         all updates of all start phases; nothing follows from them.</p></details>",
        escaped(costs::machine())
    )?;
    page.push_str(
        "<details><summary>Rates</summary><p>Forces are computed at 1 kHz from the last published state; the state itself is updated at 70, 300 or \
         1000 Hz, or as often as its cost allows. Start phases shift the updates against the motion, since late contact depends on it.</p></details>\n\
         <details><summary>Another method, another recipe</summary><p>A method is an implementation of <code>HapticMethod</code> (update, publish, force, pose) in \
         <code>tests/lab/src/methods</code> and a line of <code>Method</code>; a recipe is a file in <code>tests/lab/src/recipes</code> with scene, motion, right answer \
         and pass lines. Everything on this page then includes it. Whether scenes choose their fidelity well is a page of its own: \
         <code>taut-lab fidelity</code>.</p></details>\n",
    );
    Ok(())
}
