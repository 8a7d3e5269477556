//! The SDO client: tables of dialogues written from CiA 301 7.2.4, and transfers with a model of a
//! server over a wire that loses and doubles frames.

mod block_download;
mod block_upload;
mod corpus;
mod dialogue;
mod expedited;
mod harness;
mod properties;
mod segmented;
mod timing;
