//! rerun's stream and its page, served here: rerun's own services behind our guard, on sockets of our own.
//!
//! What rerun would start by itself answers every `Host`, the pages of other origins, and takes messages from anybody. Its parts are
//! public: its protocol is spoken behind [`Guard`] here, from a [`History`] of our own.

use std::net::TcpListener;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::response::IntoResponse;
use futures_util::stream::{Stream, StreamExt as _, empty};
use http::{StatusCode, Uri, header};
use re_log_encoding::ToTransport as _;
use re_log_encoding::rrd::Compression;
use re_protos::sdk_comms::v1alpha1::message_proxy_service_server::{
    MessageProxyService, MessageProxyServiceServer,
};
use re_protos::sdk_comms::v1alpha1::{
    ReadMessagesRequest, ReadMessagesResponse, ReadTablesRequest, ReadTablesResponse,
    WriteMessagesRequest, WriteMessagesResponse, WriteTableRequest, WriteTableResponse,
};
use re_web_viewer_server::WebViewerData;
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};
use tokio::sync::watch;
use tonic::service::Routes;
use tonic::transport::Server;
use tonic::{Request, Response, Status, Streaming};

use crate::error::MonitorError;
use crate::guard::Guard;
use crate::guests::incoming;
use crate::history::History;

/// Pings by which a client that is gone without a word is found.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(10);
/// See [`KEEPALIVE_INTERVAL`].
const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(20);

/// The running server, as rerun feeds it. Dropped, it closes both ports.
pub(crate) struct Hosted {
    history: Arc<History>,
    /// Chunks when the history has grown; gone, it is the end.
    grown: watch::Sender<()>,
}

impl Hosted {
    /// Serves the stream and the page on these sockets.
    pub(crate) fn start(
        stream: TcpListener,
        page: TcpListener,
        allowed_origins: Vec<String>,
        history: Arc<History>,
    ) -> Result<Hosted, MonitorError> {
        let not_served = |error: &dyn std::fmt::Display| MonitorError::Rerun {
            what: "to be served",
            reason: error.to_string(),
        };
        let viewer = WebViewerData::load(None).map_err(|error| not_served(&error))?;
        let page_port = page
            .local_addr()
            .map_err(|error| not_served(&error))?
            .port();
        for socket in [&stream, &page] {
            socket
                .set_nonblocking(true)
                .map_err(|error| not_served(&error))?;
        }
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(|error| not_served(&error))?;
        let (grown, growth) = watch::channel(());
        let proxy = Proxy {
            history: Arc::clone(&history),
            growth: growth.clone(),
        };
        std::thread::Builder::new()
            .name("taut-monitor-web".to_owned())
            .spawn(move || {
                runtime.block_on(async {
                    let stream = serve_stream(stream, page_port, &allowed_origins, proxy);
                    let page = serve_page(page, viewer, growth);
                    let (stream, page) = futures_util::join!(stream, page);
                    for error in [stream, page].into_iter().filter_map(Result::err) {
                        tracing::warn!("the monitor is not served any more: {error}");
                    }
                });
                runtime.shutdown_background();
            })
            .map_err(MonitorError::Thread)?;
        Ok(Hosted { history, grown })
    }
}

type Served = Result<(), Box<dyn std::error::Error + Send + Sync>>;

async fn serve_stream(
    socket: TcpListener,
    page_port: u16,
    allowed_origins: &[String],
    proxy: Proxy,
) -> Served {
    let stopped = proxy.growth.clone();
    Server::builder()
        .accept_http1(true) // browsers speak gRPC-Web
        .http2_keepalive_interval(Some(KEEPALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(KEEPALIVE_TIMEOUT))
        .layer(Guard {
            page_port: Some(page_port),
        })
        .layer(re_grpc_server::cors_layer(allowed_origins))
        .layer(tonic_web::GrpcWebLayer::new())
        .add_routes(Routes::new(MessageProxyServiceServer::new(proxy)))
        .serve_with_incoming_shutdown(incoming(socket)?, end(stopped))
        .await?;
    Ok(())
}

async fn serve_page(
    socket: TcpListener,
    viewer: WebViewerData,
    stopped: watch::Receiver<()>,
) -> Served {
    let viewer = Arc::new(viewer);
    let pages = axum::Router::new().fallback(move |target: Uri| {
        let viewer = viewer.clone();
        async move { file(&viewer, target.path()) }
    });
    Server::builder()
        .accept_http1(true)
        .layer(Guard { page_port: None })
        .add_routes(Routes::from(pages))
        .serve_with_incoming_shutdown(incoming(socket)?, end(stopped))
        .await?;
    Ok(())
}

/// One of the viewer's files.
type Pick = fn(&WebViewerData) -> &[u8];

/// A file of the viewer where it is: one has 42 MB, and who asks for it need not take it.
struct InPlace {
    viewer: Arc<WebViewerData>,
    pick: Pick,
}

impl AsRef<[u8]> for InPlace {
    fn as_ref(&self) -> &[u8] {
        (self.pick)(&self.viewer)
    }
}

/// A file of the viewer, not copied.
fn file(viewer: &Arc<WebViewerData>, path: &str) -> axum::response::Response {
    let in_place = |pick: Pick| {
        Bytes::from_owner(InPlace {
            viewer: viewer.clone(),
            pick,
        })
    };
    let (kind, bytes) = match path {
        "/" | "/index.html" => ("text/html", in_place(WebViewerData::index_html)),
        "/favicon.ico" => ("image/x-icon", in_place(WebViewerData::favicon)),
        "/apple-touch-icon.png" => ("image/png", in_place(WebViewerData::apple_touch_icon)),
        "/sw.js" => ("text/javascript", in_place(WebViewerData::sw_js)),
        "/re_viewer.js" => ("text/javascript", in_place(WebViewerData::viewer_js)),
        "/re_viewer_bg.wasm" => ("application/wasm", in_place(WebViewerData::viewer_wasm)),
        _ => return StatusCode::NOT_FOUND.into_response(),
    };
    // The page's progress bar asks for a length by a name of its own.
    let length = (
        header::HeaderName::from_static("rerun-final-length"),
        bytes.len().to_string(),
    );
    ([(header::CONTENT_TYPE, kind)], [length], bytes).into_response()
}

async fn end(mut stopped: watch::Receiver<()>) {
    // An error means that the sender is gone: the end.
    while stopped.changed().await.is_ok() {}
}

/// What an observer may ask of the stream.
struct Proxy {
    history: Arc<History>,
    growth: watch::Receiver<()>,
}

type Chunks<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

#[tonic::async_trait]
impl MessageProxyService for Proxy {
    type ReadMessagesStream = Chunks<ReadMessagesResponse>;
    type ReadTablesStream = Chunks<ReadTablesResponse>;

    async fn read_messages(
        &self,
        _: Request<ReadMessagesRequest>,
    ) -> Result<Response<Self::ReadMessagesStream>, Status> {
        let messages = self.history.observe(self.growth.clone());
        let chunks = messages.map(|message| {
            Ok(ReadMessagesResponse {
                log_msg: Some(message),
            })
        });
        Ok(Response::new(Box::pin(chunks)))
    }

    async fn read_tables(
        &self,
        _: Request<ReadTablesRequest>,
    ) -> Result<Response<Self::ReadTablesStream>, Status> {
        Ok(Response::new(Box::pin(empty()))) // there are none
    }

    async fn write_messages(
        &self,
        _: Request<Streaming<WriteMessagesRequest>>,
    ) -> Result<Response<WriteMessagesResponse>, Status> {
        Err(nobody_writes())
    }

    async fn write_table(
        &self,
        _: Request<WriteTableRequest>,
    ) -> Result<Response<WriteTableResponse>, Status> {
        Err(nobody_writes())
    }
}

fn nobody_writes() -> Status {
    Status::permission_denied("this stream is to be read")
}

impl LogSink for Hosted {
    fn send(&self, message: LogMsg) {
        match message.to_transport(Compression::LZ4) {
            Ok(message) => {
                self.history.add(message.into());
                self.grown.send_replace(());
            }
            Err(error) => tracing::warn!("rerun cannot encode a message: {error}"),
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(()) // Observers get what they get: nothing here may wait for them.
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_the_page_is_copied_for_nobody() {
        let viewer = WebViewerData::load(None).expect("it is built in");
        let viewer = Arc::new(viewer);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .expect("a runtime");
        for (path, whole) in [
            ("/", viewer.index_html()),
            ("/re_viewer_bg.wasm", viewer.viewer_wasm()),
        ] {
            let body = file(&viewer, path).into_body();
            let body = runtime.block_on(axum::body::to_bytes(body, usize::MAX));
            let body = body.expect("a body");
            assert_eq!(body.as_ptr_range(), whole.as_ptr_range(), "{path}");
        }
    }
}
