//! The scene of a real `taut serve` changed while it runs: by an operator at the page, by `taut edit`, and beside the file watch.

mod edits;
mod places;

use std::io::{Read, Write};

use serde_json::Value;

use crate::operator::{Served, TOKEN, with_token_file};
use crate::support::{Workplace, taut, wait_until};

/// A ball over a plate whose upper face is at 20 mm.
const SCENE: &str = r##"name = "bench"
[god_object]
shape = { sphere = { radius = 0.02 } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.05] }

# The plate of the bench.
[[obstacle]]
name = "plate"
shape = { box = { half_extents = [0.1, 0.1, 0.02] } }
pose = { position = [0.0, 0.0, 0.0] } # its middle
color = "#c03030" # red
surface = { friction = 0.2 }
"##;

/// The workbench with a page, the scene above, and these changes of its text.
fn bench(changes: &[(&str, &str)]) -> String {
    let mut text =
        with_token_file().replacen("scene = \"sphere-on-plane\"", "scene = \"bench.toml\"", 1);
    for (from, to) in changes {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        text = changed;
    }
    text
}

fn serve(changes: &[(&str, &str)], more: &[&str]) -> Served {
    let place = Workplace::new();
    place.write("bench.toml", SCENE);
    place.write("other.toml", &SCENE.replace("\"bench\"", "\"other\""));
    let served = Served::start_in(place, &bench(changes), more);
    wait_until("a session", || served.status().is_some());
    served
}

impl Served {
    pub(crate) fn edit(&self, wish: &Value) -> (u16, String) {
        let body = wish.to_string();
        let head = format!(
            "{}Authorization: Bearer {TOKEN}\r\nContent-Length: {}\r\n",
            self.host(),
            body.len()
        );
        self.post(&head, &body)
    }

    /// What it says to a wish that it takes.
    pub(crate) fn takes(&self, wish: &Value) -> String {
        let (status, said) = self.edit(wish);
        assert_eq!(status, 200, "{said}");
        said
    }

    /// That it says why it takes none of a wish.
    pub(crate) fn refuses(&self, wish: &Value, why: &str) {
        let (status, said) = self.edit(wish);
        assert!(status == 409 && said.contains(why), "{wish}: {said}");
    }

    fn post(&self, head: &str, body: &str) -> (u16, String) {
        let mut stream = self.send("POST /edit", head);
        // Who is refused by his head alone may find the connection closed.
        let _ = stream.write_all(body.as_bytes());
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        let (head, text) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
        let status = head.split(' ').nth(1).and_then(|word| word.parse().ok());
        (status.unwrap_or(0), text.trim().to_owned())
    }

    pub(crate) fn scene(&self) -> Value {
        let (status, text) = self.ask("GET /scene", &self.host());
        assert_eq!(status, 200, "{text}");
        serde_json::from_str(&text).expect("JSON")
    }

    fn revision(&self) -> u64 {
        self.scene()["standing"]["revision"]
            .as_u64()
            .expect("a number")
    }

    /// What the page shows of the plate.
    fn plate(&self, key: &str) -> Value {
        self.scene()["scene"]["objects"][1][key].clone()
    }

    fn file(&self) -> String {
        std::fs::read_to_string(self.place.path("bench.toml")).expect("a file")
    }

    /// That `taut edit` does it and says this.
    fn edits(&self, more: &[&str], part: &str) -> String {
        let (code, said) = self.taut_edit(more);
        assert!(code == Some(0) && said.contains(part), "{said}");
        said
    }

    /// That `taut edit` refuses it and says this.
    fn edits_not(&self, more: &[&str], part: &str) {
        let (code, said) = self.taut_edit(more);
        assert!(code == Some(2) && said.contains(part), "{said}");
    }

    fn taut_edit(&self, more: &[&str]) -> (Option<i32>, String) {
        let token = self.place.text("operator.token");
        let mut arguments = vec!["edit", "--page", &self.address, "--token-file", &token];
        arguments.extend(more);
        let output = taut(&arguments);
        let said = [output.stdout, output.stderr].concat();
        (
            output.status.code(),
            String::from_utf8_lossy(&said).into_owned(),
        )
    }
}
