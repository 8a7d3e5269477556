//! An outside program, written plainly on a blocking socket.

use crate::PATIENCE;
use bus::{Doors, Protocol};
use std::io::{Read, Write};
use std::net::TcpStream;

pub(crate) struct Peer {
    pub(crate) stream: TcpStream,
    unread: Vec<u8>,
}

impl Peer {
    pub(crate) fn connect(doors: &Doors, protocol: Protocol) -> Peer {
        let mut addresses = doors.addresses().iter();
        let address = addresses
            .find(|address| address.protocol() == protocol)
            .unwrap();
        let stream = TcpStream::connect((address.host(), address.port())).unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Peer {
            stream,
            unread: Vec::new(),
        }
    }

    /// Goes through the whole handshake.
    pub(crate) fn join(doors: &Doors, protocol: Protocol) -> Peer {
        let mut peer = Peer::connect(doors, protocol);
        match protocol {
            Protocol::Socketcand => {
                peer.expect("< hi >");
                peer.say("< open can0 >");
                peer.expect("< ok >");
                peer.say("< rawmode >");
                peer.expect("< ok >");
            }
            Protocol::Slcan => {
                peer.say("O\r");
                peer.expect("\r");
            }
            Protocol::SocketCan => panic!("nobody is behind an interface by TCP"),
        }
        peer
    }

    pub(crate) fn say(&mut self, text: &str) {
        self.stream.write_all(text.as_bytes()).unwrap();
    }

    /// What one call to the system yields, as python-can reads its handshake.
    pub(crate) fn one_read(&mut self) -> String {
        let mut bytes = [0; 4096];
        let count = self.stream.read(&mut bytes).unwrap();
        String::from_utf8(bytes[..count].to_vec()).unwrap()
    }

    /// Reads exactly this text.
    pub(crate) fn expect(&mut self, text: &str) {
        let mut bytes = vec![0; text.len()];
        self.read_exact(&mut bytes);
        assert_eq!(String::from_utf8_lossy(&bytes), text);
    }

    fn read_exact(&mut self, bytes: &mut [u8]) {
        let kept = self.unread.len().min(bytes.len());
        bytes[..kept].copy_from_slice(&self.unread[..kept]);
        self.unread.drain(..kept);
        self.stream.read_exact(&mut bytes[kept..]).unwrap();
    }

    /// Reads up to and including this byte.
    pub(crate) fn until(&mut self, end: u8) -> String {
        loop {
            if let Some(at) = self.unread.iter().position(|byte| *byte == end) {
                let text = self.unread.drain(..=at).collect();
                return String::from_utf8(text).unwrap();
            }
            let mut bytes = [0; 65_536];
            let count = self.stream.read(&mut bytes).unwrap();
            assert!(count > 0, "closed instead of {:?}", char::from(end));
            self.unread.extend_from_slice(&bytes[..count]);
        }
    }

    /// Reads until the other end closes.
    pub(crate) fn rest(&mut self) -> String {
        let mut bytes = std::mem::take(&mut self.unread);
        self.stream.read_to_end(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// Nothing is there to be read now, nor for a while.
    pub(crate) fn hears_nothing(&mut self) {
        assert!(self.unread.is_empty());
        self.stream
            .set_read_timeout(Some(std::time::Duration::from_millis(120)))
            .unwrap();
        let mut byte = [0];
        let error = self.stream.read(&mut byte).unwrap_err();
        assert!(matches!(
            error.kind(),
            std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
        ));
        self.stream.set_read_timeout(Some(PATIENCE)).unwrap();
    }
}
