//! A new cluster key comes while the old one still counts: nobody has to stop.

use crate::support::*;
use std::time::{Duration, SystemTime};
use taut_link::{
    AlsoKey, ClientLink, ClientOptions, ClusterKey, Holder, JoinKey, LinkError, Role, ServerLink,
    ServerOptions, connect,
};

async fn join(
    server: &ServerLink,
    key: impl Into<JoinKey>,
    node: &str,
) -> Result<ClientLink, LinkError> {
    connect(ClientOptions {
        key: key.into(),
        ..options(server, Role::Observer, node)
    })
    .await
}

async fn serving(key: ClusterKey, also: Option<AlsoKey>) -> ServerLink {
    server_with(ServerOptions {
        also,
        idle_timeout: FORGIVING,
        ..ServerOptions::loopback(key)
    })
    .await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn old_and_new_credentials_open_and_trust_one_server_while_both_keys_count() {
    let (new, old) = (key('a'), key('b'));
    let also = AlsoKey {
        key: old.clone(),
        until: SystemTime::now() + Duration::from_secs(3600),
    };
    let server = serving(new.clone(), Some(also)).await;
    let credential = |of: &ClusterKey| of.credential(Role::Observer, Holder::AnyNode, 1);
    // Each pins the identity of its own key: TLS shows the one that was asked for.
    let _clients = [
        must(join(&server, new.clone(), "master-new").await),
        must(join(&server, old.clone(), "master-old").await),
        must(join(&server, credential(&new), "new").await),
        must(join(&server, credential(&old), "old").await),
    ];
    assert_eq!(server.clients().len(), 4);
    match join(&server, key('c'), "stranger").await {
        Err(LinkError::WrongServer { found, .. }) => assert_eq!(found, new.server_pin()),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("a third key was let in"),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn when_its_time_is_over_the_old_key_opens_nothing_and_those_in_by_it_go() {
    let (new, old) = (key('a'), key('b'));
    let until = SystemTime::now() + Duration::from_secs(2);
    let also = AlsoKey {
        key: old.clone(),
        until,
    };
    let server = serving(new.clone(), Some(also)).await;
    let by_new = must(join(&server, new, "new").await);
    let by_old = must(join(&server, old.clone(), "old").await);
    wait_until("end of the old key", || by_old.is_closed().is_some()).await;
    assert!(SystemTime::now() >= until);
    let reason = by_old.is_closed().unwrap_or_default();
    assert!(reason.contains("time of its cluster key"), "{reason}");
    assert_eq!(by_new.is_closed(), None);
    let error = join(&server, old, "old").await.err();
    assert!(
        matches!(error, Some(LinkError::WrongServer { .. })),
        "{error:?}"
    );
}
