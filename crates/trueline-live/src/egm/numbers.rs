//! EGM's lists. They have a known greatest length, so reading one takes nothing from the heap.

use prost::bytes::{Buf, BufMut};
use prost::encoding::{DecodeContext, WireType, bool, double, merge_loop, skip_field};
use prost::{DecodeError, Message};

/// At most `N` numbers, behind a truth value where the message has one.
///
/// Without a truth value the numbers are field `ALONE`; behind one, which is field 1, they are field 2. EgmMeasuredForce comes in
/// both forms: RobotWare 6 sends the force alone. All forms are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<const N: usize, const ALONE: u32> {
    /// The truth value.
    pub flag: Option<bool>,
    values: [f64; N],
    /// More than `N` if more arrived. Then all are ignored, because they belong to another kind of robot.
    count: usize,
}

/// A number an axis: degrees or mm of the joints, mm/s and degrees/s, N and N·m.
pub type Axes = Numbers<6, 1>;
/// Whether a collision was detected, and the measure of it an axis.
pub type Collision = Numbers<6, 2>;
/// The signal and the numbers that the RAPID program sends along.
pub type RapidData = Numbers<40, 2>;

impl<const N: usize, const ALONE: u32> Default for Numbers<N, ALONE> {
    fn default() -> Self {
        Self { flag: None, values: [0.0; N], count: 0 }
    }
}

impl<const N: usize, const ALONE: u32> From<[f64; N]> for Numbers<N, ALONE> {
    fn from(values: [f64; N]) -> Self {
        Self { flag: None, values, count: N }
    }
}

impl<const N: usize, const ALONE: u32> Numbers<N, ALONE> {
    /// The same numbers behind a truth value.
    #[must_use]
    pub fn with_flag(self, flag: Option<bool>) -> Self {
        Self { flag, ..self }
    }

    /// The numbers.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        self.values.get(..self.count).unwrap_or_default()
    }

    fn add(
        &mut self,
        wire_type: WireType,
        buf: &mut impl Buf,
        ctx: DecodeContext,
    ) -> Result<(), DecodeError> {
        let mut value = 0.0;
        double::merge(wire_type, &mut value, buf, ctx)?;
        if let Some(place) = self.values.get_mut(self.count) {
            *place = value;
        }
        self.count = self.count.saturating_add(1);
        Ok(())
    }
}

impl<const N: usize, const ALONE: u32> Message for Numbers<N, ALONE> {
    fn encode_raw(&self, buf: &mut impl BufMut) {
        if let Some(flag) = &self.flag {
            bool::encode(1, flag, buf);
        }
        double::encode_repeated(if self.flag.is_some() { 2 } else { ALONE }, self.as_slice(), buf);
    }

    fn merge_field(
        &mut self,
        field: u32,
        wire_type: WireType,
        buf: &mut impl Buf,
        ctx: DecodeContext,
    ) -> Result<(), DecodeError> {
        match (field, wire_type) {
            (1, WireType::Varint) => bool::merge(wire_type, self.flag.get_or_insert_default(), buf, ctx),
            (1 | 2, WireType::LengthDelimited) => {
                merge_loop(self, buf, ctx, |list, buf, ctx| list.add(WireType::SixtyFourBit, buf, ctx))
            }
            (1 | 2, _) => self.add(wire_type, buf, ctx),
            _ => skip_field(wire_type, field, buf, ctx),
        }
    }

    fn encoded_len(&self) -> usize {
        let flag = self.flag.as_ref().map_or(0, |flag| bool::encoded_len(1, flag));
        flag + double::encoded_len_repeated(ALONE, self.as_slice())
    }

    fn clear(&mut self) {
        *self = Self::default();
    }
}
