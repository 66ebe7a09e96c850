//! The request of an operator's page: what it wants, and whether it may have it.
//!
//! To look, the guard of the observers' port is enough: a page of this very server, or a program. To act, the token as well, in the header
//! `Authorization` alone: an address with a token in its query would stand in histories and logs.

use taut_proto::web::is_from_here;

use crate::request::{header, is_same, parsed};

/// Most bytes of a request's body.
const MAX_BODY_BYTES: usize = 65_536;

/// What an operator does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deed {
    /// Lets force in.
    Arm,
    /// Keeps force out.
    Disarm,
}

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    Page,
    /// The newest status line alone.
    Status,
    /// Every status line.
    Lines,
    Scene,
    /// Whether the token is right.
    Token,
    /// The scene changed, as the body says.
    Edit(Body),
    /// Pictures of what the render nodes show.
    Pictures,
    /// One of these, by its number.
    Picture(u64),
    Act(Deed),
}

/// Where the body of a request is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Body {
    /// First byte after the head.
    pub(crate) begins: usize,
    /// Bytes, at most [`MAX_BODY_BYTES`].
    pub(crate) length: usize,
}

/// Why it is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// No HTTP, or one that is not understood.
    NotHttp,
    /// Asked for by a page from elsewhere, or by a name that may be anybody's.
    Foreign,
    NotFound,
    LookByGet,
    ActByPost,
    NoToken,
    WrongToken,
    /// The length of its body is not said, or is no number.
    NoLength,
    /// Its body is longer than [`MAX_BODY_BYTES`].
    TooLong,
    /// As many pages are open as may be.
    Full,
}

impl Refusal {
    /// Status and what to do.
    pub(crate) fn text(self) -> (&'static str, &'static str) {
        const UNAUTHORIZED: &str = "401 Unauthorized";
        const NOT_ALLOWED: &str = "405 Method Not Allowed";
        match self {
            Self::NotHttp => ("400 Bad Request", "this port speaks HTTP"),
            Self::Foreign => (
                "403 Forbidden",
                "ask by address or as localhost, from a page of this server",
            ),
            Self::NotFound => (
                "404 Not Found",
                "there are /, /status, /stream and /scene to look, /arm, /disarm, /edit, /pictures, /picture/NUMBER and /token to act",
            ),
            Self::LookByGet => (NOT_ALLOWED, "looking is by GET"),
            Self::ActByPost => (NOT_ALLOWED, "acting is by POST"),
            Self::NoToken => (
                UNAUTHORIZED,
                "acting needs the token of the address that `taut serve` printed, or of [operator] token_file: the header `Authorization: Bearer TOKEN`",
            ),
            Self::WrongToken => (
                UNAUTHORIZED,
                "the token is not this server's: open the address that `taut serve` printed last, or the one with the line of [operator] token_file",
            ),
            Self::NoLength => (
                "411 Length Required",
                "an edit has a body, whose length is said in the header `Content-Length`",
            ),
            Self::TooLong => (
                "413 Content Too Large",
                "an edit has at most 65536 bytes: put larger changes into the scene file",
            ),
            Self::Full => (
                "503 Service Unavailable",
                "as many operator's pages are open as may be: close one",
            ),
        }
    }

    /// Why, for the audit trail; `None` for what harms nobody.
    pub(crate) fn audited(self) -> Option<&'static str> {
        match self {
            Self::NotFound | Self::LookByGet | Self::NoLength | Self::Full => None,
            Self::TooLong => Some("a body that is too long"),
            Self::NotHttp => Some("no HTTP"),
            Self::Foreign => Some("a page from elsewhere, or a name that may be anybody's"),
            Self::ActByPost => Some("acting, but not by POST"),
            Self::NoToken => Some("no token"),
            Self::WrongToken => Some("a wrong token"),
        }
    }
}

/// Reads a request's head; `None` while it is not whole.
pub(crate) fn read(head: &[u8], token: &str) -> Option<Result<Call, Refusal>> {
    parsed(head, |request| match request {
        Some((request, length)) => judge(request, length, token),
        None => Err(Refusal::NotHttp),
    })
}

fn judge(request: &httparse::Request<'_, '_>, begins: usize, token: &str) -> Result<Call, Refusal> {
    if !is_from_here(|name| header(request, name), None) {
        return Err(Refusal::Foreign);
    }
    let target = request.path.unwrap_or_default();
    let path = target.split_once('?').map_or(target, |(path, _)| path);
    let call = match path {
        "/" => Call::Page,
        "/status" => Call::Status,
        "/stream" => Call::Lines,
        "/scene" => Call::Scene,
        "/token" => Call::Token,
        "/edit" => Call::Edit(Body { begins, length: 0 }),
        "/arm" => Call::Act(Deed::Arm),
        "/disarm" => Call::Act(Deed::Disarm),
        "/pictures" => Call::Pictures,
        _ => Call::Picture(picture_number(path).ok_or(Refusal::NotFound)?),
    };
    match call {
        Call::Page | Call::Status | Call::Lines | Call::Scene => match request.method {
            Some("GET") => Ok(call),
            _ => Err(Refusal::LookByGet),
        },
        // What is on the screens is shown to nobody who could not change it.
        Call::Token | Call::Act(_) | Call::Edit(_) | Call::Pictures | Call::Picture(_) => {
            if request.method != Some("POST") {
                return Err(Refusal::ActByPost);
            }
            let given = header(request, "Authorization")
                .and_then(|value| value.strip_prefix("Bearer "))
                .ok_or(Refusal::NoToken)?;
            if !is_same(given.trim(), token) {
                return Err(Refusal::WrongToken);
            }
            match call {
                Call::Edit(_) => Ok(Call::Edit(Body {
                    begins,
                    length: body_length(request)?,
                })),
                call => Ok(call),
            }
        }
    }
}

fn picture_number(path: &str) -> Option<u64> {
    let digits = path.strip_prefix("/picture/")?;
    let is_number = digits.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| digits.parse().ok()).flatten()
}

fn body_length(request: &httparse::Request<'_, '_>) -> Result<usize, Refusal> {
    let said = header(request, "Content-Length").map(str::trim);
    let digits = said.filter(|text| text.bytes().all(|byte| byte.is_ascii_digit()));
    let length = match digits {
        None | Some("") => return Err(Refusal::NoLength),
        // A number that is too large for one is too long, too.
        Some(digits) => digits.parse().unwrap_or(usize::MAX),
    };
    if length > MAX_BODY_BYTES {
        return Err(Refusal::TooLong);
    }
    Ok(length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TOKEN: &str = "0123456789abcdef";
    const HERE: &str = "Host: 127.0.0.1:4861\r\n";
    const SHOWN: &str = "Authorization: Bearer 0123456789abcdef\r\n";

    fn ask(line: &str, headers: &str) -> Result<Call, Refusal> {
        let head = format!("{line} HTTP/1.1\r\n{headers}\r\n");
        read(head.as_bytes(), TOKEN).expect("whole")
    }

    #[test]
    fn looking_needs_no_token_and_acting_does() {
        assert_eq!(ask("GET /", HERE), Ok(Call::Page));
        assert_eq!(ask("GET /status?x=1", HERE), Ok(Call::Status));
        assert_eq!(ask("GET /stream", HERE), Ok(Call::Lines));
        let own = format!("{HERE}{SHOWN}Origin: http://127.0.0.1:4861\r\n");
        for (line, call) in [
            ("POST /arm", Call::Act(Deed::Arm)),
            ("POST /disarm", Call::Act(Deed::Disarm)),
            ("POST /token", Call::Token),
            ("POST /pictures", Call::Pictures),
            ("POST /picture/17", Call::Picture(17)),
        ] {
            assert_eq!(ask(line, &own), Ok(call));
            assert_eq!(ask(line, &format!("{HERE}{SHOWN}")), Ok(call), "a program");
            assert_eq!(ask(line, HERE), Err(Refusal::NoToken));
            for wrong in ["", "0123456789abcdeF", "0123456789abcdef0"] {
                let headers = format!("{HERE}Authorization: Bearer {wrong}\r\n");
                assert!(matches!(
                    ask(line, &headers),
                    Err(Refusal::WrongToken | Refusal::NoToken)
                ));
            }
            let in_query = format!("{line}?token={TOKEN}");
            assert_eq!(ask(&in_query, HERE), Err(Refusal::NoToken));
        }
        assert_eq!(read(b"POST /arm HT", TOKEN), None);
    }

    #[test]
    fn acting_is_by_post_and_the_token_helps_no_page_from_elsewhere() {
        let shown = format!("{HERE}{SHOWN}");
        for method in ["GET", "HEAD", "PUT", "OPTIONS", "post"] {
            let refused = ask(&format!("{method} /arm"), &shown);
            assert_eq!(refused, Err(Refusal::ActByPost), "{method}");
        }
        assert_eq!(ask("POST /stream", &shown), Err(Refusal::LookByGet));
        assert_eq!(ask("POST /favicon.ico", &shown), Err(Refusal::NotFound));
        for number in ["", "-1", "+1", "1/2", "x", "99999999999999999999"] {
            let refused = ask(&format!("POST /picture/{number}"), &shown);
            assert_eq!(refused, Err(Refusal::NotFound), "{number}");
        }
        for headers in [
            format!("{shown}Origin: http://evil.example\r\n"),
            format!("{shown}Origin: http://127.0.0.1:4860\r\n"),
            format!("{shown}Origin: null\r\n"),
            format!("{shown}Sec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: image\r\n"),
            format!("Host: rebound.example:4861\r\n{SHOWN}"),
        ] {
            for line in [
                "POST /arm",
                "POST /disarm",
                "POST /token",
                "POST /pictures",
                "POST /picture/1",
                "GET /stream",
            ] {
                assert_eq!(ask(line, &headers), Err(Refusal::Foreign), "{headers}");
            }
        }
    }

    #[test]
    fn an_edit_needs_the_token_first_and_then_a_body_of_a_length_that_is_said() {
        let shown = format!("{HERE}{SHOWN}");
        let sized = |length: &str| format!("{shown}Content-Length: {length}\r\n");
        let length = |headers: &str| match ask("POST /edit", headers) {
            Ok(Call::Edit(body)) => Ok(body.length),
            Ok(call) => panic!("{call:?}"),
            Err(refusal) => Err(refusal),
        };
        assert_eq!(length(&sized("65536")), Ok(65_536));
        for (said, refusal) in [
            ("65537", Refusal::TooLong),
            ("99999999999999999999999999", Refusal::TooLong),
            ("-1", Refusal::NoLength),
            ("", Refusal::NoLength),
            ("1e3", Refusal::NoLength),
        ] {
            assert_eq!(length(&sized(said)), Err(refusal), "{said}");
        }
        let chunked = format!("{shown}Transfer-Encoding: chunked\r\n");
        assert_eq!(length(&chunked), Err(Refusal::NoLength));
        // Nothing is read of the body of somebody without the token.
        let none = format!("{HERE}Content-Length: 10\r\n");
        assert_eq!(length(&none), Err(Refusal::NoToken));
        assert_eq!(ask("GET /edit", &sized("3")), Err(Refusal::ActByPost));
        assert_eq!(ask("GET /scene", HERE), Ok(Call::Scene));
        assert_eq!(ask("POST /scene", &shown), Err(Refusal::LookByGet));
        let whole = b"POST /edit HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer 0123456789abcdef\r\nContent-Length: 2\r\n\r\n{}";
        let Some(Ok(Call::Edit(body))) = read(whole, TOKEN) else {
            panic!("whole")
        };
        assert_eq!(&whole[body.begins..][..body.length], b"{}");
    }

    proptest! {
        #[test]
        fn no_bytes_get_by_without_the_token(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let mut head = b"POST /arm HTTP/1.1\r\nHost: localhost\r\n".to_vec();
            head.extend(&bytes);
            prop_assert!(!matches!(read(&head, TOKEN), Some(Ok(_))));
            let _ = read(&bytes, TOKEN);
        }
    }
}
