//! The makers of robots, one a row: names and units of the columns of a pose, and the meaning of the rotation.

/// Theirs (lower case, without unit), ours, our unit.
pub(super) type Column = (&'static [&'static str], &'static str, &'static str);

/// How a maker writes a pose.
pub(super) struct Maker {
    /// Its name on the command line.
    pub name: &'static str,
    /// Columns and meaning, in words.
    pub words: &'static str,
    /// Its columns.
    pub columns: &'static [Column],
    /// The columns of a file without a line of names, in the form for `--columns`.
    pub usual: &'static str,
}

/// x, y and z in millimetres, under the usual names.
macro_rules! millimetres {
    ($($rotation:expr),+ $(,)?) => {
        &[
            (&["x", "pos_x"], "x", "_mm"),
            (&["y", "pos_y"], "y", "_mm"),
            (&["z", "pos_z"], "z", "_mm"),
            $($rotation),+
        ]
    };
}

/// Three angles about z, then the new y, then the new z.
macro_rules! zyz {
    ($first:expr, $second:expr, $third:expr) => {
        millimetres!(
            ($first, "euler_zyz_intrinsic_1", "_deg"),
            ($second, "euler_zyz_intrinsic_2", "_deg"),
            ($third, "euler_zyz_intrinsic_3", "_deg"),
        )
    };
}

/// Three angles about the fixed x, then y, then z.
macro_rules! fixed_xyz {
    ($first:expr, $second:expr, $third:expr) => {
        millimetres!(($first, "roll", "_deg"), ($second, "pitch", "_deg"), ($third, "yaw", "_deg"))
    };
}

/// Three angles about z, then the new y, then the new x.
macro_rules! zyx {
    ($first:expr, $second:expr, $third:expr) => {
        millimetres!(($first, "a", "_deg"), ($second, "b", "_deg"), ($third, "c", "_deg"))
    };
}

/// All, in the order in which they are listed.
pub(super) const MAKERS: [Maker; 18] = [
    Maker {
        name: "abb",
        words: "ABB: x, y, z in mm; quaternion q1, q2, q3, q4 = w, x, y, z",
        columns: &[
            (&["x", "pos_x", "trans.x"], "x", "_mm"),
            (&["y", "pos_y", "trans.y"], "y", "_mm"),
            (&["z", "pos_z", "trans.z"], "z", "_mm"),
            (&["q1", "u0", "qw", "rot.q1"], "qw", ""),
            (&["q2", "u1", "qx", "rot.q2"], "qx", ""),
            (&["q3", "u2", "qy", "rot.q3"], "qy", ""),
            (&["q4", "u3", "qz", "rot.q4"], "qz", ""),
        ],
        usual: "t,x,y,z,q1,q2,q3,q4",
    },
    Maker {
        name: "kuka",
        words: "KUKA: X, Y, Z in mm; A, B, C in degrees, about z, then the new y, then the new x",
        columns: &[
            (&["x", "pos_act_mes.x", "pos_act.x"], "x", "_mm"),
            (&["y", "pos_act_mes.y", "pos_act.y"], "y", "_mm"),
            (&["z", "pos_act_mes.z", "pos_act.z"], "z", "_mm"),
            (&["a", "pos_act_mes.a", "pos_act.a"], "a", "_deg"),
            (&["b", "pos_act_mes.b", "pos_act.b"], "b", "_deg"),
            (&["c", "pos_act_mes.c", "pos_act.c"], "c", "_deg"),
        ],
        usual: "t,X,Y,Z,A,B,C",
    },
    Maker {
        name: "ur",
        words: "UR: x, y, z in m; rx, ry, rz the rotation vector in rad",
        columns: &[
            (&["timestamp"], "time", "_s"),
            (&["x", "actual_tcp_pose_0", "pose_0", "tcp_pose_0", "tcp_0"], "x", "_m"),
            (&["y", "actual_tcp_pose_1", "pose_1", "tcp_pose_1", "tcp_1"], "y", "_m"),
            (&["z", "actual_tcp_pose_2", "pose_2", "tcp_pose_2", "tcp_2"], "z", "_m"),
            (&["rx", "actual_tcp_pose_3", "pose_3", "tcp_pose_3", "tcp_3"], "rx", "_rad"),
            (&["ry", "actual_tcp_pose_4", "pose_4", "tcp_pose_4", "tcp_4"], "ry", "_rad"),
            (&["rz", "actual_tcp_pose_5", "pose_5", "tcp_pose_5", "tcp_5"], "rz", "_rad"),
        ],
        usual: "t,x,y,z,rx,ry,rz",
    },
    Maker {
        name: "fanuc",
        words: "FANUC: X, Y, Z in mm; W, P, R in degrees, about the fixed x, then y, then z",
        columns: millimetres!((&["w"], "w", "_deg"), (&["p"], "p", "_deg"), (&["r"], "r", "_deg")),
        usual: "t,X,Y,Z,W,P,R",
    },
    Maker {
        name: "yaskawa",
        words: "Yaskawa: X, Y, Z in mm; Rx, Ry, Rz in degrees, about the fixed x, then y, then z",
        columns: fixed_xyz!(&["rx"], &["ry"], &["rz"]),
        usual: "t,X,Y,Z,Rx,Ry,Rz",
    },
    Maker {
        name: "staubli",
        words: "Stäubli: x, y, z in mm; rx, ry, rz in degrees, about x, then the new y, then the new z",
        columns: millimetres!(
            (&["rx"], "euler_xyz_intrinsic_1", "_deg"),
            (&["ry"], "euler_xyz_intrinsic_2", "_deg"),
            (&["rz"], "euler_xyz_intrinsic_3", "_deg"),
        ),
        usual: "t,x,y,z,rx,ry,rz",
    },
    Maker {
        name: "kawasaki",
        words: "Kawasaki: X, Y, Z in mm; O, A, T in degrees, about z, then the new y, then the new z",
        columns: zyz!(&["o"], &["a"], &["t"]),
        usual: "time_s,X,Y,Z,O,A,T",
    },
    Maker {
        name: "doosan",
        words: "Doosan: x, y, z in mm; a, b, c (or rx, ry, rz) in degrees, about z, then the new y, then the new z",
        columns: zyz!(&["a", "rx"], &["b", "ry"], &["c", "rz"]),
        usual: "t,x,y,z,a,b,c",
    },
    Maker {
        name: "comau",
        words: "Comau: X, Y, Z in mm; A, E, R in degrees, about z, then the new y, then the new z",
        columns: zyz!(&["a"], &["e", "b"], &["r", "c"]),
        usual: "t,X,Y,Z,A,E,R",
    },
    Maker {
        name: "mitsubishi",
        words: "Mitsubishi: X, Y, Z in mm; A, B, C in degrees, about the fixed x, then y, then z",
        columns: fixed_xyz!(&["a"], &["b"], &["c"]),
        usual: "t,X,Y,Z,A,B,C",
    },
    Maker {
        name: "xarm",
        words: "UFACTORY xArm: x, y, z in mm; roll, pitch, yaw in degrees, about the fixed x, then y, then z",
        columns: fixed_xyz!(&["roll", "rx"], &["pitch", "ry"], &["yaw", "rz"]),
        usual: "t,x,y,z,roll,pitch,yaw",
    },
    Maker {
        name: "denso",
        words: "Denso: X, Y, Z in mm; RX, RY, RZ in degrees, about the fixed x, then y, then z",
        columns: fixed_xyz!(&["rx"], &["ry"], &["rz"]),
        usual: "t,X,Y,Z,RX,RY,RZ",
    },
    Maker {
        name: "omron",
        words: "Omron TM, Techman: x, y, z in mm; rx, ry, rz in degrees, about the fixed x, then y, then z",
        columns: fixed_xyz!(&["rx"], &["ry"], &["rz"]),
        usual: "t,x,y,z,rx,ry,rz",
    },
    Maker {
        name: "nachi",
        words: "Nachi: X, Y, Z in mm; roll, pitch, yaw in degrees, about z, then the new y, then the new x",
        columns: zyx!(&["roll", "rz"], &["pitch", "ry"], &["yaw", "rx"]),
        usual: "t,X,Y,Z,roll,pitch,yaw",
    },
    Maker {
        name: "epson",
        words: "Epson: X, Y, Z in mm; U, V, W in degrees, about z, then the new y, then the new x",
        columns: zyx!(&["u"], &["v"], &["w"]),
        usual: "t,X,Y,Z,U,V,W",
    },
    Maker {
        name: "franka",
        words: "Franka: O_T_EE[0] to O_T_EE[15], 4 × 4 column by column, in m; time in s",
        columns: &[
            (&["o_t_ee_0", "pose_0"], "r11", ""),
            (&["o_t_ee_1", "pose_1"], "r21", ""),
            (&["o_t_ee_2", "pose_2"], "r31", ""),
            (&["o_t_ee_4", "pose_4"], "r12", ""),
            (&["o_t_ee_5", "pose_5"], "r22", ""),
            (&["o_t_ee_6", "pose_6"], "r32", ""),
            (&["o_t_ee_8", "pose_8"], "r13", ""),
            (&["o_t_ee_9", "pose_9"], "r23", ""),
            (&["o_t_ee_10", "pose_10"], "r33", ""),
            (&["o_t_ee_12", "pose_12"], "x", "_m"),
            (&["o_t_ee_13", "pose_13"], "y", "_m"),
            (&["o_t_ee_14", "pose_14"], "z", "_m"),
        ],
        usual: "t,O_T_EE_0,O_T_EE_1,O_T_EE_2,…,O_T_EE_15",
    },
    Maker {
        name: "matrix",
        words: "matrix: x, y, z in mm; r11 to r33 row by row, columns are the axes of the tool",
        columns: &[(&["x"], "x", "_mm"), (&["y"], "y", "_mm"), (&["z"], "z", "_mm")],
        usual: "t,r11,r12,r13,r21,r22,r23,r31,r32,r33,x,y,z",
    },
    Maker {
        name: "ros",
        words: "ROS: x, y, z in m; quaternion qx, qy, qz, qw by name",
        columns: &[
            (&["x", "position.x", "translation.x", "p_rs_r_x"], "x", "_m"),
            (&["y", "position.y", "translation.y", "p_rs_r_y"], "y", "_m"),
            (&["z", "position.z", "translation.z", "p_rs_r_z"], "z", "_m"),
            (&["qw", "orientation.w", "rotation.w", "q_rs_w"], "qw", ""),
            (&["qx", "orientation.x", "rotation.x", "q_rs_x"], "qx", ""),
            (&["qy", "orientation.y", "rotation.y", "q_rs_y"], "qy", ""),
            (&["qz", "orientation.z", "rotation.z", "q_rs_z"], "qz", ""),
        ],
        usual: "t,x,y,z,qx,qy,qz,qw",
    },
];
