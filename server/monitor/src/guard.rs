//! The guard before both ports: only our own page and programs may ask, and nobody may write.

use std::task::{Context, Poll};

use futures_util::future::{Either, Ready, ready};
use http::{Request, Response, StatusCode};
use taut_proto::web::is_from_here;
use tower_layer::Layer;
use tower_service::Service;

use crate::guests::Place;

/// Begin of the names of the stream's methods by which a client would put something into it.
const WRITING: &str = "Write";

/// What a port lets through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guard {
    /// Port of the page that may ask, if it is not this one.
    pub(crate) page_port: Option<u16>,
}

impl Guard {
    fn lets_through<B>(self, request: &Request<B>) -> bool {
        let said = |name: &str| {
            let value = request.headers().get(name)?;
            // What is no text is no address either.
            Some(value.to_str().unwrap_or("?"))
        };
        // HTTP/2 names the server in the request's target.
        let target = request.uri().authority().map(http::uri::Authority::as_str);
        let header = |name: &str| match name {
            "host" => target.or_else(|| said(name)),
            name => said(name),
        };
        let writes = request
            .uri()
            .path()
            .rsplit('/')
            .next()
            .is_some_and(|method| method.starts_with(WRITING));
        !writes && is_from_here(header, self.page_port)
    }
}

impl<S> Layer<S> for Guard {
    type Service = Guarded<S>;

    fn layer(&self, inner: S) -> Guarded<S> {
        Guarded {
            inner,
            guard: *self,
        }
    }
}

/// A service behind a guard.
#[derive(Clone, Debug)]
pub(crate) struct Guarded<S> {
    inner: S,
    guard: Guard,
}

impl<S, B, R> Service<Request<B>> for Guarded<S>
where
    S: Service<Request<B>, Response = Response<R>>,
    R: Default,
{
    type Response = Response<R>;
    type Error = S::Error;
    type Future = Either<S::Future, Ready<Result<Response<R>, S::Error>>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), S::Error>> {
        self.inner.poll_ready(context)
    }

    fn call(&mut self, request: Request<B>) -> Self::Future {
        if self.guard.lets_through(&request) {
            if let Some(place) = request.extensions().get::<Place>() {
                place.settle();
            }
            return Either::Left(self.inner.call(request));
        }
        let mut refusal = Response::new(R::default());
        *refusal.status_mut() = StatusCode::FORBIDDEN;
        Either::Right(ready(Ok(refusal)))
    }
}
