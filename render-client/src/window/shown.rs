//! What windows show besides the scene: as the server's scene says, and as keys switch it.

use taut_proto::scene::Show;
use winit::keyboard::KeyCode;

/// What is shown. Of the scene and a key, what changed last counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    /// What the scene said last.
    said: Show,
    now: Show,
}

impl Shown {
    /// As a scene says.
    pub(super) fn new(said: Show) -> Self {
        Self { said, now: said }
    }

    /// What is shown now.
    pub(super) fn now(&self) -> Show {
        self.now
    }

    /// Switches what belongs to a key, if anything does.
    pub(super) fn key(&mut self, code: KeyCode) {
        let Show {
            ghost,
            contacts,
            force,
            hud,
            reflections,
        } = &mut self.now;
        let switched = match code {
            KeyCode::KeyG => ghost,
            KeyCode::KeyC => contacts,
            KeyCode::KeyV => force,
            KeyCode::KeyH => hud,
            KeyCode::KeyM => reflections,
            _ => return,
        };
        *switched = !*switched;
    }

    /// Takes what another scene says otherwise than the one before; what a key switched stays.
    pub(super) fn follow(&mut self, said: Show) {
        let (old, now) = (self.said, self.now);
        let taken = |old: bool, said: bool, now: bool| if said == old { now } else { said };
        self.now = Show {
            ghost: taken(old.ghost, said.ghost, now.ghost),
            contacts: taken(old.contacts, said.contacts, now.contacts),
            force: taken(old.force, said.force, now.force),
            hud: taken(old.hud, said.hud, now.hud),
            reflections: taken(old.reflections, said.reflections, now.reflections),
        };
        self.said = said;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_key_switched_stays_when_the_scene_changes() {
        let said = Show::default();
        let mut shown = Shown::new(said);
        let keys = [
            KeyCode::KeyG,
            KeyCode::KeyC,
            KeyCode::KeyV,
            KeyCode::KeyH,
            KeyCode::KeyM,
        ];
        for key in keys {
            shown.key(key);
        }
        let switched = Show {
            ghost: true,
            contacts: true,
            force: true,
            hud: true,
            reflections: false,
        };
        assert_eq!(shown.now(), switched);
        shown.follow(said);
        assert_eq!(shown.now(), switched, "the file says what it said");
    }

    #[test]
    fn what_the_workbench_file_changed_is_shown_whatever_keys_said() {
        let mut shown = Shown::new(Show::default());
        shown.key(KeyCode::KeyV);
        shown.key(KeyCode::KeyG);
        let edited = Show {
            ghost: true,
            contacts: true,
            ..Show::default()
        };
        shown.follow(edited);
        let both = Show {
            force: true,
            ..edited
        };
        assert_eq!(shown.now(), both);
        shown.follow(Show {
            ghost: false,
            ..edited
        });
        let without = Show {
            ghost: false,
            ..both
        };
        assert_eq!(shown.now(), without);
        shown.key(KeyCode::KeyX);
        assert_eq!(shown.now(), without, "no key of these");
    }
}
