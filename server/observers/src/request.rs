//! The request of an observer: what it wants, and whether it may have it.
//!
//! Without a token only pages of this very server may ask, under a name that cannot be another's: a page from elsewhere in a
//! browser on this machine could otherwise open a WebSocket to the loopback address and read along.

use taut_proto::web::is_from_here;

/// Most bytes of a request's head.
pub(crate) const MAX_REQUEST_BYTES: usize = 8192;
/// Most lines of a request's head.
const MAX_HEADERS: usize = 64;

/// What an observer wants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Wish {
    Page,
    /// The `hello` line alone.
    Hello,
    Metrics,
    /// Lines as the body of an answer.
    Lines,
    /// Lines over WebSocket; the client's key.
    WebSocket(String),
}

/// Why it does not get it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// No HTTP, or one that is not understood.
    NotHttp,
    /// Not a GET.
    Method,
    NotFound,
    /// The token is missing or wrong.
    Token,
    /// Asked for by a page from elsewhere.
    Foreign,
    /// `/ws` without a WebSocket's key.
    NotWebSocket,
}

impl Refusal {
    /// Status and what to do.
    pub(crate) fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::NotHttp => ("400 Bad Request", "this port speaks HTTP and WebSocket"),
            Self::Method => ("405 Method Not Allowed", "use GET"),
            Self::NotFound => (
                "404 Not Found",
                "there are /, /hello, /stream, /ws and /metrics",
            ),
            Self::Token => (
                "401 Unauthorized",
                "give the token: the header `Authorization: Bearer TOKEN`, or ?token=TOKEN",
            ),
            Self::Foreign => (
                "403 Forbidden",
                "ask by address, from a page of this server; or set a token in [observers]",
            ),
            Self::NotWebSocket => (
                "426 Upgrade Required",
                "/ws speaks WebSocket; /stream is plain HTTP",
            ),
        }
    }
}

/// Reads a request's head; `None` while it is not whole.
pub(crate) fn read(head: &[u8], token: Option<&str>) -> Option<Result<Wish, Refusal>> {
    parsed(head, |request| match request {
        Some((request, _)) => judge(request, token),
        None => Err(Refusal::NotHttp),
    })
}

/// What `judge` makes of a head that is whole: of a request and the length of its head, bytes, or of `None` where it is none.
pub(crate) fn parsed<T>(
    head: &[u8],
    judge: impl FnOnce(Option<(&httparse::Request<'_, '_>, usize)>) -> T,
) -> Option<T> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Partial) => None,
        Ok(httparse::Status::Complete(length)) => Some(judge(Some((&request, length)))),
        Err(_) => Some(judge(None)),
    }
}

/// The first header of this name, if it is text.
pub(crate) fn header<'b>(request: &httparse::Request<'_, 'b>, name: &str) -> Option<&'b str> {
    let mut headers = request.headers.iter();
    let found = headers.find(|h| h.name.eq_ignore_ascii_case(name));
    found.and_then(|h| std::str::from_utf8(h.value).ok())
}

fn judge(request: &httparse::Request<'_, '_>, token: Option<&str>) -> Result<Wish, Refusal> {
    let target = request.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let header = |name: &str| header(request, name);
    match token {
        Some(token) => {
            let bearer = header("Authorization").and_then(|value| value.strip_prefix("Bearer "));
            let asked = query
                .split('&')
                .find_map(|pair| pair.strip_prefix("token="));
            if !bearer
                .or(asked)
                .is_some_and(|given| is_same(given.trim(), token))
            {
                return Err(Refusal::Token);
            }
        }
        None if !is_from_here(header, None) => {
            return Err(Refusal::Foreign);
        }
        None => {}
    }
    if request.method != Some("GET") {
        return Err(Refusal::Method);
    }
    match path {
        "/" => Ok(Wish::Page),
        "/hello" => Ok(Wish::Hello),
        "/metrics" => Ok(Wish::Metrics),
        "/stream" => Ok(Wish::Lines),
        "/ws" => header("Sec-WebSocket-Key")
            .map(|key| Wish::WebSocket(key.to_owned()))
            .ok_or(Refusal::NotWebSocket),
        _ => Err(Refusal::NotFound),
    }
}

/// Compares hashes: the time that it takes tells nothing of the token.
pub(crate) fn is_same(given: &str, token: &str) -> bool {
    blake3::hash(given.as_bytes()) == blake3::hash(token.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ask(target: &str, headers: &str, token: Option<&str>) -> Result<Wish, Refusal> {
        let head = format!("GET {target} HTTP/1.1\r\n{headers}\r\n");
        read(head.as_bytes(), token).expect("whole")
    }

    const HERE: &str = "Host: 127.0.0.1:4859\r\n";

    #[test]
    fn wishes_are_understood() {
        assert_eq!(ask("/", HERE, None), Ok(Wish::Page));
        assert_eq!(ask("/hello?x=1", HERE, None), Ok(Wish::Hello));
        assert_eq!(ask("/metrics", HERE, None), Ok(Wish::Metrics));
        assert_eq!(ask("/stream", "Host: [::1]:80\r\n", None), Ok(Wish::Lines));
        let key = format!("{HERE}sec-websocket-key: abc\r\n");
        assert_eq!(ask("/ws", &key, None), Ok(Wish::WebSocket("abc".into())));
        assert_eq!(ask("/ws", HERE, None), Err(Refusal::NotWebSocket));
        assert_eq!(ask("/secret", HERE, None), Err(Refusal::NotFound));
        assert_eq!(read(b"GET / HT", None), None);
        assert_eq!(read(b"\x16\x03\x01\0", None), Some(Err(Refusal::NotHttp)));
        let post = b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n";
        assert_eq!(read(post, None), Some(Err(Refusal::Method)));
    }

    #[test]
    fn pages_from_elsewhere_and_names_that_may_be_anybody_s_are_refused() {
        let own = format!("{HERE}Origin: http://127.0.0.1:4859\r\n");
        assert_eq!(ask("/", &own, None), Ok(Wish::Page));
        for headers in [
            format!("{HERE}Origin: http://evil.example\r\n"),
            format!("{HERE}Origin: null\r\n"),
            format!("{HERE}Origin: https://127.0.0.1:4859\r\n"),
            format!("{HERE}Sec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: image\r\n"),
            "Host: rebound.example:4859\r\n".to_owned(),
            "Origin: http://evil.example\r\n".to_owned(),
        ] {
            assert_eq!(
                ask("/stream", &headers, None),
                Err(Refusal::Foreign),
                "{headers}"
            );
        }
    }

    #[test]
    fn with_a_token_only_the_token_opens() {
        let token = Some("0123456789abcdef");
        let bearer = |t: &str| format!("Host: lab.example\r\nAuthorization: Bearer {t}\r\n");
        assert_eq!(ask("/", &bearer("0123456789abcdef"), token), Ok(Wish::Page));
        let query = "/stream?a=b&token=0123456789abcdef";
        assert_eq!(ask(query, "Host: lab.example\r\n", token), Ok(Wish::Lines));
        for (target, headers) in [
            ("/", HERE.to_owned()),
            ("/", bearer("0123456789abcdeF")),
            ("/?token=", HERE.to_owned()),
            ("/nothing", HERE.to_owned()),
        ] {
            assert_eq!(
                ask(target, &headers, token),
                Err(Refusal::Token),
                "{target}"
            );
        }
    }

    proptest! {
        #[test]
        fn no_bytes_break_it(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes, None);
            let mut head = b"GET /ws HTTP/1.1\r\n".to_vec();
            head.extend(bytes);
            let _ = read(&head, Some("token"));
        }
    }
}
