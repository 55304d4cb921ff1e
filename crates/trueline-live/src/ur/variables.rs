//! Fields that controllers offer, with their types.

/// Type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One byte, 0 or 1.
    Bool,
    /// One byte.
    Uint8,
    /// Four bytes.
    Uint32,
    /// Eight bytes.
    Uint64,
    /// Four bytes with a sign.
    Int32,
    /// Eight bytes.
    Double,
    /// Three of them.
    Vector3d,
    /// Six of them.
    Vector6d,
    /// Six numbers of four bytes with a sign.
    Vector6Int32,
    /// Six numbers of four bytes.
    Vector6Uint32,
}

use Kind::{Bool, Double, Int32, Uint8, Uint32, Uint64, Vector3d, Vector6Int32, Vector6Uint32, Vector6d};

/// Names and sizes of the types.
const KINDS: [(Kind, &str, usize); 10] = [
    (Bool, "BOOL", 1),
    (Uint8, "UINT8", 1),
    (Uint32, "UINT32", 4),
    (Uint64, "UINT64", 8),
    (Int32, "INT32", 4),
    (Double, "DOUBLE", 8),
    (Vector3d, "VECTOR3D", 24),
    (Vector6d, "VECTOR6D", 48),
    (Vector6Int32, "VECTOR6INT32", 24),
    (Vector6Uint32, "VECTOR6UINT32", 24),
];

impl Kind {
    /// Its name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        KINDS.iter().find(|(kind, ..)| *kind == self).map_or("", |(_, name, _)| name)
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(self) -> usize {
        KINDS.iter().find(|(kind, ..)| *kind == self).map_or(0, |(.., bytes)| *bytes)
    }

    /// By its name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        KINDS.iter().find(|(_, known, _)| *known == name).map(|(kind, ..)| *kind)
    }
}

/// Outputs of a controller of today, but for the registers.
const OUTPUTS: [(&str, Kind); 69] = [
    ("timestamp", Double),
    ("target_q", Vector6d),
    ("target_qd", Vector6d),
    ("target_qdd", Vector6d),
    ("target_current", Vector6d),
    ("target_moment", Vector6d),
    ("actual_q", Vector6d),
    ("actual_qd", Vector6d),
    ("actual_current", Vector6d),
    ("actual_current_window", Vector6d),
    ("joint_control_output", Vector6d),
    ("actual_TCP_pose", Vector6d),
    ("actual_TCP_speed", Vector6d),
    ("actual_TCP_force", Vector6d),
    ("target_TCP_pose", Vector6d),
    ("target_TCP_speed", Vector6d),
    ("actual_digital_input_bits", Uint64),
    ("joint_temperatures", Vector6d),
    ("actual_execution_time", Double),
    ("robot_mode", Int32),
    ("joint_mode", Vector6Int32),
    ("safety_mode", Int32),
    ("safety_status", Int32),
    ("actual_tool_accelerometer", Vector3d),
    ("speed_scaling", Double),
    ("target_speed_fraction", Double),
    ("actual_momentum", Double),
    ("actual_main_voltage", Double),
    ("actual_robot_voltage", Double),
    ("actual_robot_current", Double),
    ("actual_joint_voltage", Vector6d),
    ("actual_digital_output_bits", Uint64),
    ("runtime_state", Uint32),
    ("elbow_position", Vector3d),
    ("elbow_velocity", Vector3d),
    ("robot_status_bits", Uint32),
    ("safety_status_bits", Uint32),
    ("analog_io_types", Uint32),
    ("standard_analog_input0", Double),
    ("standard_analog_input1", Double),
    ("standard_analog_output0", Double),
    ("standard_analog_output1", Double),
    ("io_current", Double),
    ("euromap67_input_bits", Uint32),
    ("euromap67_output_bits", Uint32),
    ("euromap67_24V_voltage", Double),
    ("euromap67_24V_current", Double),
    ("tool_mode", Uint32),
    ("tool_analog_input_types", Uint32),
    ("tool_analog_input0", Double),
    ("tool_analog_input1", Double),
    ("tool_output_voltage", Int32),
    ("tool_output_current", Double),
    ("tool_temperature", Double),
    ("tcp_force_scalar", Double),
    ("output_bit_registers0_to_31", Uint32),
    ("output_bit_registers32_to_63", Uint32),
    ("input_bit_registers0_to_31", Uint32),
    ("input_bit_registers32_to_63", Uint32),
    ("tool_output_mode", Uint8),
    ("tool_digital_output0_mode", Uint8),
    ("tool_digital_output1_mode", Uint8),
    ("payload", Double),
    ("payload_cog", Vector3d),
    ("payload_inertia", Vector6d),
    ("script_control_line", Uint32),
    ("ft_raw_wrench", Vector6d),
    ("joint_position_deviation_ratio", Double),
    ("tcp_offset", Vector6d),
];

/// Numbered outputs: 64 bits, 48 whole numbers, 48 others, each way.
const REGISTERS: [(&str, Kind, u32); 6] = [
    ("output_int_register_", Int32, 48),
    ("output_double_register_", Double, 48),
    ("output_bit_register_", Bool, 128),
    ("input_int_register_", Int32, 48),
    ("input_double_register_", Double, 48),
    ("input_bit_register_", Bool, 128),
];

/// The type of an output; `None` if the name is unknown.
#[must_use]
pub fn output(name: &str) -> Option<Kind> {
    let numbered = || {
        REGISTERS.iter().find_map(|(prefix, kind, count)| {
            let number = name.strip_prefix(prefix)?.parse::<u32>().ok()?;
            (number < *count).then_some(*kind)
        })
    };
    OUTPUTS.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind).or_else(numbered)
}
