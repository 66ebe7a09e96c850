//! Whether a browser's request comes from a page of this very server: the guard before everything that speaks HTTP here.
//!
//! A page from anywhere, opened in a browser on this machine or on one that a tunnel leads to, can send requests to the loopback address. Three
//! things tell it from our own page, and a page cannot choose any: the name that the server was asked by (`Host`: by rebinding its
//! own name to this address, a page from elsewhere becomes of one origin with us), the page that asks (`Origin`), and, where a browser names none, as
//! for a picture or a frame, whether that is of another site (`Sec-Fetch-Site`, which browsers send to the loopback address and to HTTPS).

use std::net::IpAddr;

/// Whether a request may be answered; `header` gives what it says under a name, which is in lower case.
///
/// The server must be asked by address or as `localhost`. A page must be the server's own: of the same origin, or, with `page_port`,
/// from that port under the same name; all names of the loopback address count as one. Whatever page a person comes from, he may open one here.
#[must_use]
pub fn is_from_here<'a>(header: impl Fn(&str) -> Option<&'a str>, page_port: Option<u16>) -> bool {
    let host = header("host");
    let asked = host.and_then(authority);
    if host.is_some() && asked.is_none() {
        return false;
    }
    let Some(origin) = header("origin") else {
        let site = header("sec-fetch-site"); // programs say nothing
        let is_opened = header("sec-fetch-dest") == Some("document"); // in a window of its own, not within a page
        return matches!(site, None | Some("same-origin" | "none")) || is_opened;
    };
    let Some((name, port)) = asked else {
        return false; // a script of HTTP/1.0 has no page
    };
    let Some((page, from)) = origin.strip_prefix("http://").and_then(authority) else {
        return false;
    };
    let is_same_port = page_port.map_or(from == port, |page_port| from == Some(page_port));
    is_same_port && (page == name || page.is_loopback() && name.is_loopback())
}

/// Address and port of what is written before a path; `None` for a name that may be anybody's.
fn authority(text: &str) -> Option<(IpAddr, Option<u16>)> {
    let (name, rest) = match text.strip_prefix('[') {
        Some(bracketed) => bracketed.split_once(']')?,
        None => text.split_at(text.find(':').unwrap_or(text.len())),
    };
    let port = match rest.strip_prefix(':') {
        Some(port) => Some(port.parse().ok()?),
        None if rest.is_empty() => None,
        None => return None,
    };
    let address = if name.eq_ignore_ascii_case("localhost") {
        IpAddr::from([127, 0, 0, 1])
    } else {
        name.parse().ok()?
    };
    Some((address, port))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    const HERE: Option<&str> = Some("127.0.0.1:9876");

    fn is_from_here(host: Option<&str>, origin: Option<&str>, page_port: Option<u16>) -> bool {
        let header = |name: &str| match name {
            "host" => host,
            "origin" => origin,
            _ => None,
        };
        super::is_from_here(header, page_port)
    }

    #[test]
    fn own_pages_and_programs_may_ask() {
        assert!(is_from_here(HERE, None, None));
        assert!(is_from_here(None, None, None), "HTTP/1.0");
        assert!(is_from_here(HERE, Some("http://127.0.0.1:9876"), None));
        assert!(is_from_here(
            HERE,
            Some("http://127.0.0.1:9090"),
            Some(9090)
        ));
        assert!(is_from_here(
            HERE,
            Some("http://localhost:9090"),
            Some(9090)
        ));
        assert!(is_from_here(
            Some("[::1]:9876"),
            Some("http://[::1]:9090"),
            Some(9090)
        ));
        assert!(is_from_here(
            Some("192.0.2.7:9876"),
            Some("http://192.0.2.7:9090"),
            Some(9090)
        ));
    }

    #[test]
    fn names_that_may_be_anybody_s_and_pages_from_elsewhere_may_not() {
        for host in [
            "rebound.example:9876",
            "127.0.0.1.evil.example:9876",
            "localhost.evil:9876",
            "",
            ":9876",
            "[::1",
            "[::1]x",
            "127.0.0.1:x",
        ] {
            assert!(!is_from_here(Some(host), None, None), "{host}");
        }
        for origin in [
            "http://evil.example",
            "https://127.0.0.1:9090",
            "null",
            "http://127.0.0.1:8000",
            "http://127.0.0.1",
            "http://192.0.2.7:9090",
            "http://rerun.io",
            "http://127.0.0.1:9090.evil.example",
            "file://",
            "",
        ] {
            assert!(!is_from_here(HERE, Some(origin), Some(9090)), "{origin}");
        }
        assert!(
            !is_from_here(HERE, Some("http://127.0.0.1:9090"), None),
            "of another port"
        );
        assert!(!is_from_here(None, Some("http://127.0.0.1:9876"), None));
    }

    #[test]
    fn a_part_of_a_page_from_elsewhere_that_is_not_named_is_refused() {
        let asks = |origin: Option<&str>, site: &str, dest: &str| {
            let header = |name: &str| match name {
                "host" => HERE,
                "origin" => origin,
                "sec-fetch-site" => Some(site),
                "sec-fetch-dest" => Some(dest),
                _ => None,
            };
            super::is_from_here(header, Some(9090))
        };
        for site in ["cross-site", "same-site", "", "SAME-ORIGIN"] {
            for dest in ["image", "script", "iframe", "object", "empty", ""] {
                assert!(!asks(None, site, dest), "{site} {dest}");
            }
        }
        assert!(asks(None, "same-origin", "image"), "our own page");
        assert!(asks(None, "none", "document"), "typed");
        assert!(
            asks(None, "cross-site", "document"),
            "a link that is followed"
        );
        // Where the page is named its name counts.
        assert!(asks(Some("http://127.0.0.1:9090"), "same-site", "empty"));
        assert!(!asks(Some("http://evil.example"), "same-origin", "empty"));
    }

    proptest! {
        #[test]
        fn no_text_breaks_it(host in ".{0,40}", origin in ".{0,40}") {
            let _ = is_from_here(Some(&host), Some(&format!("http://{origin}")), Some(1));
        }
    }
}
