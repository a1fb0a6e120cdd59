//! Accessors: typed elements in buffers. A reader is made only of ranges that are there, so that reading cannot fail.

use gltf::json::{
    Accessor, Index,
    accessor::{ComponentType, Type, sparse::Sparse},
    validation::Checked,
};

use super::{
    AssetError,
    buffer::{Buffers, sub_slice},
    document::{at, label},
};
use crate::assets::files::Context;

/// Reads the elements of an accessor. Elements that no buffer holds are 0, unless a sparse entry replaces them.
pub(super) struct Reader<'a> {
    /// Number of elements.
    pub count: usize,
    /// Numbers in an element, up to 4.
    pub components: usize,
    component: ComponentType,
    normalized: bool,
    base: Option<Elements<'a>>,
    sparse: Option<SparseElements<'a>>,
}

/// Elements at equal distances, all in range.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Elements that replace others: indices in rising order, and as many values.
struct SparseElements<'a> {
    count: usize,
    indices: Elements<'a>,
    index_type: ComponentType,
    values: Elements<'a>,
}

impl<'a> Reader<'a> {
    /// A reader of an accessor of one of these types.
    pub fn new(accessors: &[Accessor], buffers: &'a Buffers<'a>, index: Index<Accessor>, types: &[Type]) -> Result<Self, AssetError> {
        let accessor = at(accessors, index, "accessor")?;
        Self::of(accessor, buffers, types).context(|| label("accessor", index.value(), accessor.name.as_deref()))
    }

    fn of(accessor: &Accessor, buffers: &'a Buffers<'a>, types: &[Type]) -> Result<Self, AssetError> {
        let (Checked::Valid(kind), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
            return Err(AssetError::new("its type or componentType is none of glTF's"));
        };
        if !types.contains(&kind) {
            return Err(AssetError::new(format!("is of type {kind:?}, not {types:?}")));
        }
        let count = usize::try_from(accessor.count.0).map_err(|_| AssetError::new("counts more elements than memory can hold"))?;
        let component = component.0;
        let size = component.size() * kind.multiplicity();
        let base = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = buffers.view(view)?;
                Some(Elements::new(bytes, accessor.byte_offset.unwrap_or_default().0, count, size, stride)?)
            }
            None => None,
        };
        let sparse = accessor.sparse.as_ref().map(|sparse| SparseElements::new(sparse, buffers, count, size).context(|| "sparse".into()));
        let (normalized, sparse) = (accessor.normalized, sparse.transpose()?);
        Ok(Self { count, components: kind.multiplicity(), component, normalized, base, sparse })
    }

    /// Whether the elements are unsigned integers, as indices must be.
    pub fn is_unsigned(&self) -> bool {
        matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
    }

    /// Takes integers as fractions of their range, as colours always are.
    pub fn normalized(mut self) -> Self {
        self.normalized = true;
        self
    }

    /// Element `index` (below `count`) as an unsigned integer.
    pub fn index(&self, index: usize) -> u32 {
        self.element(index).map_or(0, |bytes| unsigned(self.component, bytes))
    }

    /// Element `index` (below `count`) as numbers; those that the element does not have are `missing`.
    pub fn floats<const N: usize>(&self, index: usize, missing: f32) -> [f32; N] {
        let mut numbers = [missing; N];
        let components = self.components.min(N);
        match self.element(index) {
            None => numbers[..components].fill(0.0),
            Some(bytes) => {
                for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(self.component.size()).take(components)) {
                    *number = float(self.component, self.normalized, bytes);
                }
            }
        }
        numbers
    }

    fn element(&self, index: usize) -> Option<&[u8]> {
        let size = self.component.size() * self.components;
        let sparse = self.sparse.as_ref().and_then(|sparse| sparse.find(index)).map(|(values, at)| values.get(at, size));
        sparse.or_else(|| self.base.as_ref().map(|base| base.get(index, size)))
    }
}

impl<'a> Elements<'a> {
    /// `count` elements of `size` bytes from `offset` on, if all of them are there.
    fn new(view: &'a [u8], offset: u64, count: usize, size: usize, stride: Option<usize>) -> Result<Self, AssetError> {
        let stride = stride.unwrap_or(size);
        let length = match count {
            0 => Some(0),
            _ => (count as u64 - 1).checked_mul(stride as u64).and_then(|start| start.checked_add(size as u64)),
        };
        let bytes = length.and_then(|length| sub_slice(view, offset, length)).ok_or_else(|| {
            let available = view.len();
            let message = format!(
                "{count} elements, {stride} bytes apart from byte {offset} on, are outside of its buffer view, which has {available} bytes"
            );
            AssetError::new(message)
        })?;
        Ok(Self { bytes, stride })
    }

    fn get(&self, index: usize, size: usize) -> &[u8] {
        let start = index * self.stride;
        &self.bytes[start..start + size]
    }
}

impl<'a> SparseElements<'a> {
    fn new(sparse: &Sparse, buffers: &'a Buffers<'a>, base_count: usize, size: usize) -> Result<Self, AssetError> {
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err(AssetError::new("the componentType of its indices is none of glTF's"));
        };
        let index_type = index_type.0;
        let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        let elements = |view, offset: u64, size| Elements::new(buffers.view(view)?.0, offset, count, size, None);
        let indices = elements(sparse.indices.buffer_view, sparse.indices.byte_offset.0, index_type.size())?;
        let values = elements(sparse.values.buffer_view, sparse.values.byte_offset.0, size)?;
        let this = Self { count, indices, index_type, values };
        let rising = (1..count).all(|at| this.index(at - 1) < this.index(at));
        if !rising || count > 0 && this.index(count - 1) >= base_count {
            return Err(AssetError::new(format!("its indices do not rise, or go beyond its {base_count} elements")));
        }
        Ok(this)
    }

    fn index(&self, at: usize) -> usize {
        unsigned(self.index_type, self.indices.get(at, self.index_type.size())) as usize
    }

    /// Where the value stands that replaces element `index`, if one does.
    fn find(&self, index: usize) -> Option<(&Elements<'a>, usize)> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match self.index(middle).cmp(&index) {
                std::cmp::Ordering::Equal => return Some((&self.values, middle)),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }
}

fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match (component, bytes) {
        (ComponentType::U8 | ComponentType::I8, &[a, ..]) => a.into(),
        (ComponentType::U16 | ComponentType::I16, &[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
        (_, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}

/// One number. Normalised integers follow glTF 2.0, section 3.6.2.2.
fn float(component: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, scale) = match (component, bytes) {
        (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        (ComponentType::U8, &[a]) => (f32::from(a), 255.0),
        (ComponentType::I8, &[a]) => (f32::from(a as i8), 127.0),
        (ComponentType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (ComponentType::U32, &[a, b, c, d]) => (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32),
        _ => (0.0, 1.0),
    };
    if normalized { (value / scale).max(-1.0) } else { value }
}
