//! rerun's stream and its page, served here: rerun's own services behind our guard, on sockets of our own.
//!
//! What rerun would start by itself answers every `Host`, the pages of other origins, and takes messages from anybody. Its parts are
//! public: the message proxy is put behind [`Guard`] here, and fed within the process.

use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;

use axum::response::IntoResponse;
use http::{StatusCode, Uri, header};
use re_grpc_server::{
    MAX_DECODING_MESSAGE_SIZE, MAX_ENCODING_MESSAGE_SIZE, MessageProxy, ServerOptions,
};
use re_log_encoding::ToTransport as _;
use re_log_encoding::rrd::Compression;
use re_protos::sdk_comms::v1alpha1::WriteMessagesRequest;
use re_protos::sdk_comms::v1alpha1::message_proxy_service_client::MessageProxyServiceClient;
use re_protos::sdk_comms::v1alpha1::message_proxy_service_server::MessageProxyServiceServer;
use re_web_viewer_server::WebViewerData;
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};
use tokio::sync::{mpsc, watch};
use tonic::service::Routes;
use tonic::transport::Server;
use tonic::transport::server::TcpIncoming;

use crate::error::MonitorError;
use crate::guard::Guard;

/// Messages between the feeding thread and the server.
const WAITING_MESSAGES: usize = 32;
/// Pings by which a client that is gone without a word is found.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(10);
/// See [`KEEPALIVE_INTERVAL`].
const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(20);

/// The running server, as rerun feeds it. Dropped, it closes both ports.
pub(crate) struct Hosted {
    messages: mpsc::Sender<WriteMessagesRequest>,
    _stop: watch::Sender<()>,
}

impl Hosted {
    /// Serves the stream and the page on these sockets.
    pub(crate) fn start(
        stream: TcpListener,
        page: TcpListener,
        options: ServerOptions,
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
        let (messages, waiting) = mpsc::channel(WAITING_MESSAGES);
        let (stop, stopped) = watch::channel(());
        std::thread::Builder::new()
            .name("taut-monitor-web".to_owned())
            .spawn(move || {
                runtime.block_on(async {
                    let stream = serve_stream(stream, page_port, options, waiting, stopped.clone());
                    let page = serve_page(page, viewer, stopped);
                    let (stream, page) = futures_util::join!(stream, page);
                    for error in [stream, page].into_iter().filter_map(Result::err) {
                        tracing::warn!("the monitor is not served any more: {error}");
                    }
                });
                runtime.shutdown_background();
            })
            .map_err(MonitorError::Thread)?;
        Ok(Hosted {
            messages,
            _stop: stop,
        })
    }
}

type Served = Result<(), Box<dyn std::error::Error + Send + Sync>>;

async fn serve_stream(
    socket: TcpListener,
    page_port: u16,
    options: ServerOptions,
    mut waiting: mpsc::Receiver<WriteMessagesRequest>,
    stopped: watch::Receiver<()>,
) -> Served {
    let cors = re_grpc_server::cors_layer(&options.cors_allowed_origins);
    let proxy = MessageProxyServiceServer::from_arc(Arc::new(MessageProxy::new(options)))
        .max_decoding_message_size(MAX_DECODING_MESSAGE_SIZE)
        .max_encoding_message_size(MAX_ENCODING_MESSAGE_SIZE);
    // The one who writes: not by the network, and so past the guard.
    let mut feed = MessageProxyServiceClient::new(proxy.clone());
    tokio::spawn(async move {
        let messages = futures_util::stream::poll_fn(move |context| waiting.poll_recv(context));
        if let Err(error) = feed.write_messages(messages).await {
            tracing::warn!("rerun takes no more messages: {error}");
        }
    });
    Server::builder()
        .accept_http1(true) // browsers speak gRPC-Web
        .http2_keepalive_interval(Some(KEEPALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(KEEPALIVE_TIMEOUT))
        .layer(Guard {
            page_port: Some(page_port),
        })
        .layer(cors)
        .layer(tonic_web::GrpcWebLayer::new())
        .add_routes(Routes::new(proxy))
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

/// A file of the viewer.
fn file(viewer: &WebViewerData, path: &str) -> axum::response::Response {
    let (kind, bytes) = match path {
        "/" | "/index.html" => ("text/html", viewer.index_html()),
        "/favicon.ico" => ("image/x-icon", viewer.favicon()),
        "/apple-touch-icon.png" => ("image/png", viewer.apple_touch_icon()),
        "/sw.js" => ("text/javascript", viewer.sw_js()),
        "/re_viewer.js" => ("text/javascript", viewer.viewer_js()),
        "/re_viewer_bg.wasm" => ("application/wasm", viewer.viewer_wasm()),
        _ => return StatusCode::NOT_FOUND.into_response(),
    };
    // The page's progress bar asks for a length by a name of its own.
    let length = (
        header::HeaderName::from_static("rerun-final-length"),
        bytes.len().to_string(),
    );
    ([(header::CONTENT_TYPE, kind)], [length], bytes.to_vec()).into_response()
}

fn incoming(socket: TcpListener) -> std::io::Result<TcpIncoming> {
    let listener = tokio::net::TcpListener::from_std(socket)?;
    Ok(TcpIncoming::from(listener).with_nodelay(Some(true)))
}

async fn end(mut stopped: watch::Receiver<()>) {
    // An error means that the sender is gone: the end.
    while stopped.changed().await.is_ok() {}
}

impl LogSink for Hosted {
    fn send(&self, message: LogMsg) {
        match message.to_transport(Compression::LZ4) {
            // Fails only when the server has ended.
            Ok(message) => drop(self.messages.blocking_send(WriteMessagesRequest {
                log_msg: Some(message.into()),
            })),
            Err(error) => tracing::warn!("rerun cannot encode a message: {error}"),
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(())
    }
}
