//! The thread of the lines: who is there, what comes and what goes.

use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::sleep;

use super::Opened;
use super::line::Line;
use super::stream::Stream;

/// For how long a program that has closed its own direction still gets what is sent.
const LINGER: Duration = Duration::from_millis(500);

/// Keeps all lines until they are closed.
pub(super) async fn keep(
    opened: Vec<Opened>,
    lines: Vec<Arc<Line>>,
    closing: watch::Receiver<bool>,
) {
    let mut tasks = JoinSet::new();
    for (opened, line) in opened.into_iter().zip(lines) {
        let mut closing = closing.clone();
        tasks.spawn(async move {
            let work = async {
                match opened {
                    Opened::Tcp(listener) => attend(listener, &line).await,
                    #[cfg(unix)]
                    Opened::Pty(pty) => attend_terminal(pty, &line).await,
                }
            };
            tokio::select! {
                () = work => {}
                _ = closing.wait_for(|closing| *closing) => {}
            }
        });
    }
    while tasks.join_next().await.is_some() {}
}

/// One program after the other. Who comes while another one is there is turned away.
async fn attend(listener: TcpListener, line: &Line) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else {
        return;
    };
    let mut next = None;
    loop {
        let stream = match next.take() {
            Some(stream) => stream,
            None => accept(&listener).await,
        };
        line.connect();
        let stream = Stream::Tcp(stream);
        tokio::select! {
            () = converse(&stream, line) => {}
            () = turn_away(&listener) => {}
        }
        // What is on its way to it still is; another one need not wait for that.
        tokio::select! {
            () = write(&stream, line) => {}
            () = sleep(LINGER) => {}
            stream = accept(&listener) => next = Some(stream),
        }
        line.hang_up();
    }
}

async fn accept(listener: &tokio::net::TcpListener) -> TcpStream {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                // Without it answers are late, but right.
                let _ = stream.set_nodelay(true);
                return stream;
            }
            // Out of file descriptors, or gone already: the next may do better.
            Err(_) => sleep(Duration::from_millis(50)).await,
        }
    }
}

async fn turn_away(listener: &tokio::net::TcpListener) {
    loop {
        drop(accept(listener).await);
    }
}

#[cfg(unix)]
async fn attend_terminal(mut pty: super::pty::Pty, line: &Line) {
    loop {
        // Who has opened it is noticed by its first byte.
        let mut first = [0; 1];
        if let Ok(1) = pty.read(&mut first).await {
            line.connect();
            line.came(&first);
            pty.let_go();
            converse(&Stream::Pty(&pty), line).await;
            line.hang_up();
        } else {
            sleep(Duration::from_millis(50)).await;
        }
        while pty.hold().is_err() {
            sleep(Duration::from_millis(50)).await;
        }
    }
}

/// Both directions, until the other end sends no more.
async fn converse(stream: &Stream<'_>, line: &Line) {
    tokio::select! {
        () = read(stream, line) => {}
        () = write(stream, line) => {}
    }
}

/// What comes, until there is no more.
async fn read(stream: &Stream<'_>, line: &Line) {
    let mut bytes = [0; 4096];
    loop {
        let room = line.room().await.min(bytes.len());
        match stream.read(&mut bytes[..room]).await {
            Ok(count) if count > 0 => line.came(&bytes[..count]),
            _ => return,
        }
    }
}

/// What goes, until it cannot any more.
async fn write(stream: &Stream<'_>, line: &Line) {
    loop {
        let bytes = line.to_send().await;
        match stream.write(&bytes).await {
            Ok(count) => line.sent(count),
            Err(_) => return,
        }
    }
}
