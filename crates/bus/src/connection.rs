//! The outside end: a connection to a bus behind a door.

use crate::endpoint::{Endpoint, Protocol};
use crate::socketcand::{Messages, Piece, parse_received, write_send};
use can::Frame;
use can::slcan::{Answer, Answers, BitRate, Command};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// How a connection is made.
#[derive(Clone, Debug)]
pub struct Options {
    /// How long connecting, and each answer while opening the bus, may take. Default: 3 s.
    pub timeout: Duration,
    /// Bit rate an slcan adapter is told to use before its channel is opened. `None`, the
    /// default, leaves it as it is; `servobus sim` takes any.
    pub bit_rate: Option<BitRate>,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            timeout: Duration::from_secs(3),
            bit_rate: None,
        }
    }
}

/// A frame from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// When the other end saw it, in nanoseconds on the other end's clock (virtual time, if the
    /// bus is simulated). slcan does not say.
    pub stamp_ns: Option<u64>,
    /// The frame.
    pub frame: Frame,
}

/// What went wrong with a connection, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectionError {
    /// Nobody listens there.
    #[error(
        "nobody listens at {endpoint}: start `servobus sim` with this address, or check host and \
         port"
    )]
    NobodyThere {
        /// Where.
        endpoint: Endpoint,
    },
    /// No connection, for another reason.
    #[error("cannot connect to {endpoint}: {source}; check host, port and network")]
    Connect {
        /// Where.
        endpoint: Endpoint,
        /// What the system says.
        source: io::Error,
    },
    /// No answer in time.
    #[error(
        "{endpoint} gives no {missing} within {timeout:?}: check that a {scheme} server is there",
        scheme = endpoint.protocol().scheme()
    )]
    Timeout {
        /// Where.
        endpoint: Endpoint,
        /// What was waited for.
        missing: &'static str,
        /// How long.
        timeout: Duration,
    },
    /// The other end refuses.
    #[error("{endpoint} refuses: {text}")]
    Refused {
        /// Where.
        endpoint: Endpoint,
        /// Why, in the other end's words.
        text: String,
    },
    /// The other end does not speak the protocol.
    #[error(
        "{endpoint} does not speak {scheme}: {text}; check the port",
        scheme = endpoint.protocol().scheme()
    )]
    Protocol {
        /// Where.
        endpoint: Endpoint,
        /// What it sent.
        text: String,
    },
    /// The other end closed the connection.
    #[error("{endpoint} closed the connection: did the simulation or the adapter end?")]
    Closed {
        /// Where.
        endpoint: Endpoint,
    },
    /// The connection broke.
    #[error("the connection to {endpoint} broke: {source}")]
    Broken {
        /// Where.
        endpoint: Endpoint,
        /// What the system says.
        source: io::Error,
    },
}

/// Connects to a bus with the default options. See [`connect_with`].
///
/// # Errors
/// As [`connect_with`].
pub async fn connect(endpoint: &Endpoint) -> Result<Connection, ConnectionError> {
    connect_with(endpoint, &Options::default()).await
}

/// Connects to a bus and gets onto it: when this returns, frames flow.
///
/// # Errors
/// Nobody there, no answer in time, refused, or not the expected protocol.
pub async fn connect_with(
    endpoint: &Endpoint,
    options: &Options,
) -> Result<Connection, ConnectionError> {
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
        Protocol::Slcan => Decoder::Slcan(Answers::new()),
    };
    let mut connection = Connection {
        endpoint,
        stream,
        decoder,
        arrived: VecDeque::new(),
        text: Vec::new(),
    };
    match connection.endpoint.protocol() {
        Protocol::Socketcand => {
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
        Protocol::Slcan => {
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

/// A connection to a bus.
#[derive(Debug)]
pub struct Connection {
    endpoint: Endpoint,
    stream: TcpStream,
    decoder: Decoder,
    /// What came in and was not yet asked for.
    arrived: VecDeque<Told>,
    text: Vec<u8>,
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
        // Statistics and the like, for which nobody asked.
        _ => None,
    }
}

impl Connection {
    /// Where this leads.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// Sends a frame. Returns when the system has taken it, which may be long before it is on the
    /// bus; waits while the other end takes no more. Frames that come in meanwhile are kept for
    /// [`Connection::receive`].
    ///
    /// Must not be cancelled: half a message would spoil the next. Over socketcand a remote frame
    /// goes out as `sendrtr`, which old servers do not know.
    ///
    /// # Errors
    /// The connection is closed or broken.
    pub async fn send(&mut self, frame: Frame) -> Result<(), ConnectionError> {
        let mut text = std::mem::take(&mut self.text);
        text.clear();
        match self.endpoint.protocol() {
            Protocol::Socketcand => write_send(&mut text, &frame),
            Protocol::Slcan => text.extend_from_slice(Command::Send(frame).encode().as_bytes()),
        }
        let sent = self.write(&text).await;
        self.text = text;
        sent
    }

    /// The next frame from the bus; waits for it. May be cancelled without losing anything, so it
    /// fits into `select!` and `timeout`.
    ///
    /// # Errors
    /// The connection is closed or broken, or the other end reports an error: then the next call
    /// goes on behind it.
    pub async fn receive(&mut self) -> Result<Received, ConnectionError> {
        loop {
            match self.next().await? {
                Told::Frame(received) => return Ok(received),
                Told::Hi | Told::Ok => {}
                told => return Err(self.complaint(told)),
            }
        }
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
            Told::Hi | Told::Ok | Told::Frame(_) => {
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
