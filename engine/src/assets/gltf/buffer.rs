//! Buffers: bytes from the binary chunk, from `data:` URIs and from further files.

use std::{borrow::Cow, ops::Deref, sync::Arc};

use data_encoding::{BASE64, BASE64_NOPAD};
use gltf::json::{Buffer, Index, buffer::View};
use percent_encoding::percent_decode_str;

use super::{
    AssetError,
    document::{Document, at, label},
};
use crate::assets::{
    files::{Context, Files},
    reference::uri_name,
};

/// The bytes of every buffer of a file.
pub(super) struct Buffers<'a> {
    buffers: Vec<Bytes<'a>>,
    views: &'a [View],
}

/// Bytes from wherever they came.
pub(super) enum Bytes<'a> {
    Lent(Cow<'a, [u8]>),
    Part(Arc<[u8]>),
}

impl Deref for Bytes<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Lent(bytes) => bytes,
            Self::Part(bytes) => bytes,
        }
    }
}

impl<'a> Buffers<'a> {
    /// Finds the bytes of every buffer.
    pub fn resolve(document: &'a Document<'a>, files: &Files<'_>) -> Result<Self, AssetError> {
        let buffers = document.root.buffers.iter().enumerate();
        let buffers =
            buffers.map(|(index, buffer)| resolve(buffer, document.bin, files).context(|| label("buffer", index, buffer.name.as_deref())));
        Ok(Self { buffers: buffers.collect::<Result<_, _>>()?, views: &document.root.buffer_views })
    }

    /// A range of a buffer, and the distance between its elements where the file gives one.
    pub fn view(&self, index: Index<View>) -> Result<(&[u8], Option<usize>), AssetError> {
        let view = at(self.views, index, "buffer view")?;
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0);
        self.slice(view).map(|bytes| (bytes, stride)).context(|| label("buffer view", index.value(), view.name.as_deref()))
    }

    /// Bytes of all buffers together.
    pub fn total(&self) -> usize {
        self.buffers.iter().map(|bytes| bytes.len()).sum()
    }

    fn slice(&self, view: &View) -> Result<&[u8], AssetError> {
        let buffer = view.buffer.value();
        let Some(bytes) = self.buffers.get(buffer) else {
            return Err(AssetError::new(format!("buffer {buffer} does not exist (there are {})", self.buffers.len())));
        };
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        sub_slice(bytes, offset, length).ok_or_else(|| {
            let size = bytes.len();
            AssetError::new(format!("{length} bytes from byte {offset} are outside of buffer {buffer}, which has {size} bytes"))
        })
    }
}

/// `length` bytes from `offset`, if they are there.
pub(super) fn sub_slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = start.checked_add(usize::try_from(length).ok()?)?;
    bytes.get(start..end)
}

fn resolve<'a>(buffer: &'a Buffer, bin: Option<&'a [u8]>, files: &Files<'_>) -> Result<Bytes<'a>, AssetError> {
    let bytes = match (&buffer.uri, bin) {
        (Some(uri), _) => fetch(uri, files)?,
        (None, Some(bin)) => Bytes::Lent(bin.into()),
        (None, None) => return Err(AssetError::new("has no uri, and the file has no binary chunk")),
    };
    let (length, found) = (buffer.byte_length.0, bytes.len());
    if (found as u64) < length {
        return Err(AssetError::new(format!("shall have {length} bytes, but has {found}: the file is cut off")));
    }
    Ok(bytes)
}

/// The bytes behind a URI.
pub(super) fn fetch<'a>(uri: &'a str, files: &Files<'_>) -> Result<Bytes<'a>, AssetError> {
    match uri.strip_prefix("data:") {
        Some(data) => decode_data(data).map(|bytes| Bytes::Lent(bytes.into())),
        None => files.part(&uri_name(uri)?).map(Bytes::Part),
    }
}

/// The part of a `data:` URI behind `data:` (RFC 2397), decoded.
fn decode_data(data: &str) -> Result<Vec<u8>, AssetError> {
    let (media_type, payload) = data.split_once(',').ok_or_else(|| AssetError::new("data: URI without a comma"))?;
    if !media_type.ends_with(";base64") {
        return Ok(percent_decode_str(payload).collect());
    }
    let decoded = if payload.ends_with('=') { BASE64.decode(payload.as_bytes()) } else { BASE64_NOPAD.decode(payload.as_bytes()) };
    decoded.map_err(|error| AssetError::new(format!("data: URI: base64: {error}")))
}

/// The file that a URI names; `None` for `data:`.
pub(super) fn reference(uri: Option<&str>) -> Option<Result<String, AssetError>> {
    uri.filter(|uri| !uri.starts_with("data:")).map(uri_name)
}
