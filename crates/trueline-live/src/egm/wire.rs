//! Protocol-buffer fields on the wire, as far as EGM uses them: nothing is assumed to be there, nothing unknown is refused.
//!
//! A generated decoder will not do: RobotWare 6 and 7 use field 9 in forms that contradict each other, and a missing
//! coordinate must not become zero.

/// Why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The bytes end inside a field.
    #[error("the message is cut off")]
    Truncated,
    /// A number of more than 64 bits, or field number 0.
    #[error("the bytes are not protocol-buffer fields")]
    NotFields,
    /// A known field of another type.
    #[error("field {field} of {message} has another type than in any known RobotWare")]
    WrongType {
        /// Message of the field.
        message: &'static str,
        /// Field number.
        field: u32,
    },
    /// A part of which something is missing.
    #[error("{message} lacks its {field}")]
    Incomplete {
        /// Message that is not whole.
        message: &'static str,
        /// What it lacks.
        field: &'static str,
    },
    /// More numbers than there can be.
    #[error("{message} has more than {most} values")]
    TooMany {
        /// Message with the list.
        message: &'static str,
        /// Most there can be.
        most: usize,
    },
}

/// One field's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// Whole number or truth value.
    Varint(u64),
    /// Eight bytes.
    Fixed64(u64),
    /// Message, text or packed list.
    Bytes(&'a [u8]),
    /// Four bytes.
    Fixed32(u32),
}

/// The fields of a message, in the order of the wire.
#[derive(Clone, Debug)]
pub struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    /// Fields of a message's bytes.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], WireError> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(WireError::Truncated)?;
        self.rest = rest;
        Ok(taken)
    }

    fn eight(&mut self) -> Result<u64, WireError> {
        self.take(8)?.try_into().map(u64::from_le_bytes).map_err(|_| WireError::Truncated)
    }

    fn varint(&mut self) -> Result<u64, WireError> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let (first, rest) = self.rest.split_first().ok_or(WireError::Truncated)?;
            self.rest = rest;
            if shift == 63 && *first > 1 {
                return Err(WireError::NotFields);
            }
            value |= u64::from(first & 0x7f) << shift;
            if first & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(WireError::NotFields)
    }

    fn field(&mut self) -> Result<(u32, Value<'a>), WireError> {
        let key = self.varint()?;
        let number = u32::try_from(key >> 3).ok().filter(|n| *n > 0).ok_or(WireError::NotFields)?;
        let value = match key & 7 {
            0 => Value::Varint(self.varint()?),
            1 => Value::Fixed64(self.eight()?),
            2 => {
                let length = usize::try_from(self.varint()?).map_err(|_| WireError::Truncated)?;
                Value::Bytes(self.take(length)?)
            }
            5 => Value::Fixed32(
                self.take(4)?.try_into().map(u32::from_le_bytes).map_err(|_| WireError::Truncated)?,
            ),
            _ => return Err(WireError::NotFields),
        };
        Ok((number, value))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u32, Value<'a>), WireError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let field = self.field();
        if field.is_err() {
            self.rest = &[];
        }
        Some(field)
    }
}

/// A field as it was found, to be read as the type that it should have.
#[derive(Clone, Copy, Debug)]
pub struct Found<'a> {
    /// Name of the message, for errors.
    pub message: &'static str,
    /// Field number.
    pub field: u32,
    /// Its value.
    pub value: Value<'a>,
}

impl<'a> Found<'a> {
    fn wrong(&self) -> WireError {
        WireError::WrongType { message: self.message, field: self.field }
    }

    /// A whole number.
    ///
    /// # Errors
    /// Another type.
    pub fn whole(&self) -> Result<u64, WireError> {
        match self.value {
            Value::Varint(value) => Ok(value),
            _ => Err(self.wrong()),
        }
    }

    /// A whole number of 32 bits.
    ///
    /// # Errors
    /// Another type, or a larger number.
    pub(crate) fn whole32(&self) -> Result<u32, WireError> {
        u32::try_from(self.whole()?).map_err(|_| self.wrong())
    }

    /// A floating-point number.
    ///
    /// # Errors
    /// Another type.
    pub fn double(&self) -> Result<f64, WireError> {
        match self.value {
            Value::Fixed64(bits) => Ok(f64::from_bits(bits)),
            _ => Err(self.wrong()),
        }
    }

    /// The bytes of a message.
    ///
    /// # Errors
    /// Another type.
    pub fn bytes(&self) -> Result<&'a [u8], WireError> {
        match self.value {
            Value::Bytes(bytes) => Ok(bytes),
            _ => Err(self.wrong()),
        }
    }
}

/// Calls `each` for every field of a message.
///
/// # Errors
/// Bytes that are no fields, and what `each` refuses.
pub fn read(
    message: &'static str,
    bytes: &[u8],
    mut each: impl FnMut(u32, Found<'_>) -> Result<(), WireError>,
) -> Result<(), WireError> {
    Fields::new(bytes).try_for_each(|found| {
        let (field, value) = found?;
        each(field, Found { message, field, value })
    })
}

/// A list of at most `N` numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<const N: usize> {
    values: [f64; N],
    count: usize,
}

impl<const N: usize> Default for Numbers<N> {
    fn default() -> Self {
        Self { values: [0.0; N], count: 0 }
    }
}

impl<const N: usize> Numbers<N> {
    /// The numbers.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        &self.values[..self.count]
    }

    /// Adds what a field holds: one number, or a packed list.
    ///
    /// # Errors
    /// Another type, or more numbers than fit.
    pub fn add(&mut self, found: &Found<'_>) -> Result<(), WireError> {
        match found.value {
            Value::Fixed64(bits) => self.push(found.message, f64::from_bits(bits)),
            Value::Bytes(packed) => {
                let (eights, rest) = packed.as_chunks::<8>();
                if !rest.is_empty() {
                    return Err(WireError::Truncated);
                }
                eights.iter().try_for_each(|eight| self.push(found.message, f64::from_le_bytes(*eight)))
            }
            _ => Err(found.wrong()),
        }
    }

    fn push(&mut self, message: &'static str, value: f64) -> Result<(), WireError> {
        let place = self.values.get_mut(self.count).ok_or(WireError::TooMany { message, most: N })?;
        *place = value;
        self.count += 1;
        Ok(())
    }
}

impl<const N: usize> From<[f64; N]> for Numbers<N> {
    fn from(values: [f64; N]) -> Self {
        Self { values, count: N }
    }
}

/// A message being written.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// The bytes so far.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    fn raw_varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push((value & 0x7f) as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    /// A whole number or truth value.
    pub fn varint(&mut self, field: u32, value: u64) {
        self.raw_varint(u64::from(field) << 3);
        self.raw_varint(value);
    }

    /// A floating-point number.
    pub fn double(&mut self, field: u32, value: f64) {
        self.raw_varint(u64::from(field) << 3 | 1);
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// Floating-point numbers of fields that follow one another.
    pub fn doubles(&mut self, first_field: u32, values: &[f64]) {
        for (field, value) in (first_field..).zip(values) {
            self.double(field, *value);
        }
    }

    /// A list, one field a number as proto2 has it.
    pub fn list(&mut self, field: u32, values: &[f64]) {
        values.iter().for_each(|value| self.double(field, *value));
    }

    /// A message within this one.
    pub fn message(&mut self, field: u32, body: impl FnOnce(&mut Writer)) {
        let mut inner = Writer::default();
        body(&mut inner);
        self.raw_varint(u64::from(field) << 3 | 2);
        self.raw_varint(inner.bytes.len() as u64);
        self.bytes.extend_from_slice(&inner.bytes);
    }
}
