//! Who may join, in a workbench file: `[network] roles` and `[network] revoked`.

use std::str::FromStr;

use taut_proto::{JoinPolicy, Revoked, Role};

use crate::document::Section;

/// Reads the keys; every fault is noted. Without `roles` every role may join, without `revoked` nobody is shut out.
pub(super) fn admission(section: &Section<'_>) -> JoinPolicy {
    let mut policy = JoinPolicy::default();
    if section.has("roles") {
        policy.roles = list::<Role>(section, "roles");
        if policy.roles.is_empty() {
            section.fault("roles", "lets nobody in; name at least one role");
        }
    }
    policy.revoked = list::<Revoked>(section, "revoked");
    policy
}

fn list<T: FromStr<Err: std::fmt::Display>>(section: &Section<'_>, key: &'static str) -> Vec<T> {
    let texts = section.texts(key).unwrap_or_default();
    let parsed = texts.into_iter().filter_map(|(text, at)| {
        text.parse()
            .map_err(|error| {
                section.complain(at, format!("`{key}` in {}: {error}", section.name()));
            })
            .ok()
    });
    parsed.collect()
}
