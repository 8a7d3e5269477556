//! A connection over TCP: socketcand and slcan, as their clients speak them.

use super::{ConnectionError, NOTES, Note, Options, Received};
use crate::endpoint::{Endpoint, Protocol};
use crate::socketcand::{Messages, Piece, parse_note, parse_received, write_send};
use can::Frame;
use can::slcan::{Answer, Answers, Command};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// A conversation with a server of either protocol.
#[derive(Debug)]
pub(super) struct Stream {
    endpoint: Endpoint,
    stream: TcpStream,
    decoder: Decoder,
    /// What came in and was not yet asked for.
    arrived: VecDeque<Told>,
    text: Vec<u8>,
    notes: Vec<Note>,
    /// Notes were asked for, and the answer is not there yet.
    asks_notes: bool,
}

/// What the other end can say.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Told {
    Frame(Received),
    /// socketcand `< hi >`.
    Hi,
    /// socketcand `< ok >`, slcan carriage return.
    Ok,
    /// slcan BEL.
    No,
    /// `< error … >`.
    Error(String),
    /// `< note … >`.
    Note(Note),
    /// Not understood, but the stream goes on.
    Nonsense(String),
    /// Not understood, and nothing after it can be.
    Lost(String),
}

#[derive(Debug)]
enum Decoder {
    Socketcand(Messages),
    Slcan(Answers),
}

impl Decoder {
    fn push(&mut self, byte: u8) -> Option<Told> {
        match self {
            Decoder::Socketcand(messages) => match messages.push(byte)? {
                Piece::Message(text) => socketcand_message(&text),
                Piece::CutShort => Some(Told::Nonsense("a message without end".to_owned())),
                Piece::Lost(lost) => Some(Told::Lost(lost.to_string())),
            },
            Decoder::Slcan(answers) => match answers.push(byte)? {
                Ok(Answer::Done) => Some(Told::Ok),
                Ok(Answer::Refused) => Some(Told::No),
                Ok(Answer::Received { frame, .. }) => Some(Told::Frame(Received {
                    stamp_ns: None,
                    frame,
                })),
                Ok(_) => None,
                Err(error) => Some(Told::Nonsense(error.to_string())),
            },
        }
    }
}

fn socketcand_message(text: &str) -> Option<Told> {
    let text = text.trim();
    let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
    let frame = |remote| match parse_received(rest.split_ascii_whitespace(), remote) {
        Ok((stamp_ns, frame)) => Told::Frame(Received {
            stamp_ns: Some(stamp_ns),
            frame,
        }),
        Err(bad) => Told::Nonsense(bad.to_string()),
    };
    match word {
        "frame" => Some(frame(false)),
        "rtr" => Some(frame(true)),
        "hi" => Some(Told::Hi),
        "ok" => Some(Told::Ok),
        "error" => Some(Told::Error(rest.to_owned())),
        "note" => Some(match parse_note(rest) {
            Ok((stamp_ns, text)) => Told::Note(Note { stamp_ns, text }),
            Err(bad) => Told::Nonsense(bad.to_string()),
        }),
        // Statistics and the like, for which nobody asked.
        _ => None,
    }
}

impl Stream {
    /// Connects and gets onto the bus.
    pub(super) async fn open(
        endpoint: &Endpoint,
        options: &Options,
    ) -> Result<Stream, ConnectionError> {
        let connecting = TcpStream::connect((endpoint.host(), endpoint.port()));
        let endpoint = endpoint.clone();
        let stream = match timeout(options.timeout, connecting).await {
            Ok(Ok(stream)) => stream,
            Ok(Err(error)) if error.kind() == ErrorKind::ConnectionRefused => {
                return Err(ConnectionError::NobodyThere { endpoint });
            }
            Ok(Err(source)) => return Err(ConnectionError::Connect { endpoint, source }),
            Err(_) => {
                let timeout = options.timeout;
                return Err(ConnectionError::Timeout {
                    endpoint,
                    missing: "connection",
                    timeout,
                });
            }
        };
        // Without it frames are late, but right.
        let _ = stream.set_nodelay(true);
        let decoder = match endpoint.protocol() {
            Protocol::Socketcand => Decoder::Socketcand(Messages::default()),
            // An interface is no stream, see `connect_with`.
            Protocol::Slcan | Protocol::SocketCan => Decoder::Slcan(Answers::new()),
        };
        let mut connection = Stream {
            endpoint,
            stream,
            decoder,
            arrived: VecDeque::new(),
            text: Vec::new(),
            notes: Vec::new(),
            asks_notes: false,
        };
        match connection.decoder {
            Decoder::Socketcand(_) => {
                let open = format!("< open {} >", connection.endpoint.channel());
                connection.expect("greeting", &Told::Hi, options).await?;
                connection.write(open.as_bytes()).await?;
                connection
                    .expect("answer to open", &Told::Ok, options)
                    .await?;
                connection.write(b"< rawmode >").await?;
                connection
                    .expect("answer to rawmode", &Told::Ok, options)
                    .await?;
            }
            Decoder::Slcan(_) => {
                // The empty line ends whatever a former user left behind. Whether closing is refused,
                // because nothing was open, makes no difference.
                connection.ask(Command::Empty, None, options).await?;
                connection.ask(Command::Close, None, options).await?;
                if let Some(rate) = options.bit_rate {
                    let refusal = "the adapter does not take this bit rate";
                    connection
                        .ask(Command::BitRate(rate), Some(refusal), options)
                        .await?;
                }
                let refusal = "the adapter does not open its channel; set a bit rate it takes";
                connection
                    .ask(Command::Open, Some(refusal), options)
                    .await?;
            }
        }
        Ok(connection)
    }

    /// Sends a frame. Waits while the other end takes no more; frames that come in meanwhile are
    /// kept.
    pub(super) async fn send(&mut self, frame: Frame) -> Result<(), ConnectionError> {
        let mut text = std::mem::take(&mut self.text);
        text.clear();
        match &self.decoder {
            Decoder::Socketcand(_) => write_send(&mut text, &frame),
            Decoder::Slcan(_) => text.extend_from_slice(Command::Send(frame).encode().as_bytes()),
        }
        let sent = self.write(&text).await;
        self.text = text;
        sent
    }

    /// The next frame; waits for it. May be cancelled without losing anything.
    pub(super) async fn receive(&mut self) -> Result<Received, ConnectionError> {
        loop {
            match self.next().await? {
                Told::Frame(received) => return Ok(received),
                Told::Ok => self.asks_notes = false,
                // A server that has none.
                Told::Error(_) if self.asks_notes => self.asks_notes = false,
                Told::Note(note) if self.notes.len() < NOTES => self.notes.push(note),
                Told::Hi | Told::Note(_) => {}
                told => return Err(self.complaint(told)),
            }
        }
    }

    /// Asks the other end for notes.
    pub(super) async fn ask_notes(&mut self) -> Result<(), ConnectionError> {
        if let Decoder::Socketcand(_) = self.decoder {
            self.asks_notes = true;
            self.write(b"< notes >").await?;
        }
        Ok(())
    }

    /// The notes since the last call.
    pub(super) fn take_notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    async fn next(&mut self) -> Result<Told, ConnectionError> {
        loop {
            if let Some(told) = self.arrived.pop_front() {
                return Ok(told);
            }
            let mut bytes = [0; 4096];
            let count = self.stream.read(&mut bytes).await;
            self.take_in(count, &bytes)?;
        }
    }

    /// Decodes what was read.
    fn take_in(&mut self, count: io::Result<usize>, bytes: &[u8]) -> Result<(), ConnectionError> {
        match count {
            Ok(0) => Err(self.closed()),
            Ok(count) => {
                let bytes = bytes.iter().take(count);
                let decoder = &mut self.decoder;
                self.arrived
                    .extend(bytes.filter_map(|byte| decoder.push(*byte)));
                Ok(())
            }
            Err(error) => Err(self.broken(error)),
        }
    }

    /// Writes all of it; reads on while the other end takes nothing, because it may do so only
    /// after having got rid of something itself.
    async fn write(&mut self, mut text: &[u8]) -> Result<(), ConnectionError> {
        while !text.is_empty() {
            let mut bytes = [0; 4096];
            let (mut input, mut output) = self.stream.split();
            tokio::select! {
                biased;
                written = output.write(text) => match written {
                    Ok(count) => text = text.get(count..).unwrap_or(&[]),
                    Err(error) => return Err(self.gone(error).await),
                },
                count = input.read(&mut bytes) => self.take_in(count, &bytes)?,
            }
        }
        Ok(())
    }

    /// Waits for one particular word while the bus is being opened.
    async fn expect(
        &mut self,
        missing: &'static str,
        wanted: &Told,
        options: &Options,
    ) -> Result<(), ConnectionError> {
        match timeout(options.timeout, self.next()).await {
            Ok(Ok(told)) if told == *wanted => Ok(()),
            Ok(Ok(told)) => Err(self.complaint(told)),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(self.timed_out(missing, options)),
        }
    }

    /// Sends an slcan command and waits for its answer. Frames that an adapter still sends from an
    /// earlier session are passed over. With `refusal` a BEL is an error of that text.
    async fn ask(
        &mut self,
        command: Command,
        refusal: Option<&str>,
        options: &Options,
    ) -> Result<(), ConnectionError> {
        self.write(command.encode().as_bytes()).await?;
        let answer = async {
            loop {
                match (self.next().await?, refusal) {
                    (Told::Frame(_) | Told::Nonsense(_), _) => {}
                    (Told::Ok, _) | (Told::No, None) => return Ok(()),
                    (Told::No, Some(text)) => {
                        let (endpoint, text) = (self.endpoint.clone(), text.to_owned());
                        return Err(ConnectionError::Refused { endpoint, text });
                    }
                    (told, _) => return Err(self.complaint(told)),
                }
            }
        };
        match timeout(options.timeout, answer).await {
            Ok(result) => result,
            Err(_) => Err(self.timed_out("answer to an slcan command", options)),
        }
    }

    /// A write failed: what the other end said last is worth more than the system's error.
    async fn gone(&mut self, error: io::Error) -> ConnectionError {
        let last = async {
            loop {
                match self.next().await {
                    Ok(told @ (Told::Error(_) | Told::No)) => return Some(self.complaint(told)),
                    Ok(_) => {}
                    Err(_) => return None,
                }
            }
        };
        let said = timeout(Duration::from_millis(100), last)
            .await
            .ok()
            .flatten();
        said.unwrap_or_else(|| self.broken(error))
    }

    fn complaint(&self, told: Told) -> ConnectionError {
        let endpoint = self.endpoint.clone();
        match told {
            Told::Error(text) => ConnectionError::Refused { endpoint, text },
            Told::No => {
                let text = "a frame or command was answered by BEL".to_owned();
                ConnectionError::Refused { endpoint, text }
            }
            Told::Nonsense(text) | Told::Lost(text) => ConnectionError::Protocol { endpoint, text },
            Told::Hi | Told::Ok | Told::Frame(_) | Told::Note(_) => {
                let text = "an answer came at the wrong time".to_owned();
                ConnectionError::Protocol { endpoint, text }
            }
        }
    }

    fn timed_out(&self, missing: &'static str, options: &Options) -> ConnectionError {
        let (endpoint, timeout) = (self.endpoint.clone(), options.timeout);
        ConnectionError::Timeout {
            endpoint,
            missing,
            timeout,
        }
    }

    fn closed(&self) -> ConnectionError {
        ConnectionError::Closed {
            endpoint: self.endpoint.clone(),
        }
    }

    fn broken(&self, source: io::Error) -> ConnectionError {
        match source.kind() {
            ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => self.closed(),
            _ => ConnectionError::Broken {
                endpoint: self.endpoint.clone(),
                source,
            },
        }
    }
}
