//! KUKA's KRL with RSI: the path's program, which streams the robot's poses to a PC while it runs.
//!
//! The context has only an ETHERNET object and none that corrects positions or axes, and the configuration states
//! `ONLYSEND`. So no message of a PC can move the robot, and the controller waits for no answer. Parameters, numbers and
//! elements are those of public drivers' contexts for RSI 3 to 5: kuka_experimental of ROS-Industrial and
//! kuka-external-control-sdk; for an input, kuka-rsi3-communicator and KukaDatatypeMapping. No controller has loaded these
//! files.

use super::krl;
use super::program_file::ProgramFile;
use super::waypoints::Waypoints;
use std::net::SocketAddr;

/// The form in which the controller's version of RSI reads its objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RsiContext {
    /// RSI 4.1 and later (KSS 8.5 and later): one `.rsix`.
    Rsix,
    /// RSI 3 and 4.0 (KSS before 8.5): `.rsi.xml`, which the controller reads, and `.rsi`, which its editor reads.
    Rsi,
}

const CONFIGURATION: &str = "trueline_ethernet.xml";
const SENSOR_INTERFACE: &str = r"C:\KRC\ROBOTER\Config\User\Common\SensorInterface";
const PROGRAMS: &str = r"KRC:\R1\Program";
/// Decimals of the sent values: 1 nm and 0.000001°, finer than any resolver.
const DECIMALS: u8 = 6;
/// Late answers until RSI ends, in cycles; nothing is answered, and with `ONLYSEND` nothing is waited for.
const TIMEOUT_CYCLES: u8 = 100;
/// A single input, in place of a byte or a word of them.
const BIT: u8 = 0;

/// The program with its RSI files, for a PC that runs `trueline record --protocol kuka-rsi` at an address. `input`: the number of the digital
/// input ($IN) that a camera is wired to, which is sent along as `DiL`.
#[must_use]
pub fn files(path: &Waypoints, pc: SocketAddr, context: RsiContext, input: Option<u16>) -> Vec<ProgramFile> {
    let file = |name, folder, text: &str| ProgramFile::with_dos_lines(name, folder, text);
    let mut files = vec![file("trueline_rsi.src", PROGRAMS, &program(path, context))];
    match context {
        RsiContext::Rsix => files.push(file("trueline_rsi.rsix", SENSOR_INTERFACE, &rsix(input))),
        RsiContext::Rsi => files.extend([
            file("trueline_rsi.rsi.xml", SENSOR_INTERFACE, &rsi_xml(input)),
            file("trueline_rsi.rsi", SENSOR_INTERFACE, &rsi_model(input)),
        ]),
    }
    files.push(file(CONFIGURATION, SENSOR_INTERFACE, &configuration(pc, input)));
    files
}

fn program(path: &Waypoints, context: RsiContext) -> String {
    let name = match context {
        RsiContext::Rsix => "trueline_rsi",
        RsiContext::Rsi => "trueline_rsi.rsi",
    };
    let begin = format!(
        "; The poses are streamed from here on, of the active TOOL in the active BASE, every cycle of 4 ms, unfiltered.\n\
         ret = RSI_CREATE (\"{name}\", contid, TRUE)\n{}\
         ret = RSI_ON (#RELATIVE, #IPO_FAST)\n{}\
         WAIT SEC 2.0\n",
        halt_unless_ok(),
        halt_unless_ok(),
    );
    let end = format!("WAIT SEC 2.0\nret = RSI_OFF ()\n{}", halt_unless_ok());
    krl::program_with(
        path,
        &krl::Around {
            name: "trueline_rsi",
            declarations: "DECL INT ret\nDECL INT contid\n",
            begin: &begin,
            end: &end,
        },
    )
}

fn halt_unless_ok() -> &'static str {
    "IF (ret <> RSIOK) THEN\n  HALT\nENDIF\n"
}

/// Sent elements: actual pose, actual axes, late answers, an input. Nothing is received.
fn configuration(pc: SocketAddr, input: Option<u16>) -> String {
    let element = match input {
        Some(_) => "\x20     <ELEMENT TAG=\"DiL\" TYPE=\"BOOL\" INDX=\"1\" />\n",
        None => "",
    };
    format!(
        "<ROOT>\n\
         \x20 <CONFIG>\n\
         \x20   <IP_NUMBER>{}</IP_NUMBER>\n\
         \x20   <PORT>{}</PORT>\n\
         \x20   <SENTYPE>trueline</SENTYPE>\n\
         \x20   <ONLYSEND>TRUE</ONLYSEND>\n\
         \x20 </CONFIG>\n\
         \x20 <SEND>\n\
         \x20   <ELEMENTS>\n\
         \x20     <ELEMENT TAG=\"DEF_RIst\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\" />\n\
         \x20     <ELEMENT TAG=\"DEF_AIPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\" />\n\
         \x20     <ELEMENT TAG=\"DEF_Delay\" TYPE=\"LONG\" INDX=\"INTERNAL\" />\n{element}\
         \x20   </ELEMENTS>\n\
         \x20 </SEND>\n\
         \x20 <RECEIVE>\n\
         \x20   <ELEMENTS>\n\
         \x20   </ELEMENTS>\n\
         \x20 </RECEIVE>\n\
         </ROOT>\n",
        pc.ip(),
        pc.port(),
    )
}

/// Parameters are numbered from 0 here and from 1 in the older form.
fn rsix(input: Option<u16>) -> String {
    let (object, wire) = input.map_or_else(Default::default, |number| {
        (
            format!(
                "\x20   <RsiObject ObjTypeId=\"29\" ObjType=\"DigIn\" ObjId=\"DigIn_1\">\n\
                 \x20     <Parameters>\n\
                 \x20       <Parameter Name=\"Index\" ParamId=\"0\" ParamValue=\"{number}\" />\n\
                 \x20       <Parameter Name=\"DataType\" ParamId=\"1\" ParamValue=\"{BIT}\" />\n\
                 \x20     </Parameters>\n\
                 \x20   </RsiObject>\n"
            ),
            "\x20     <Inputs>\n\
             \x20       <Input InIdx=\"0\" OutObjId=\"DigIn_1\" OutIdx=\"0\" />\n\
             \x20     </Inputs>\n",
        )
    });
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
         <RsiContext xsi:schemaLocation=\"RsiContext RsiContext.xsd\" SchemaVersion=\"2.0.0\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xmlns=\"RsiContext\">\n\
         \x20 <RsiObjects xmlns=\"RsiDriver\">\n{object}\
         \x20   <RsiObject ObjTypeId=\"64\" ObjType=\"Ethernet\" ObjId=\"Ethernet_1\">\n{wire}\
         \x20     <Parameters>\n\
         \x20       <Parameter IsRuntime=\"false\" Name=\"ConfigFile\" ParamId=\"0\" ParamValue=\"{CONFIGURATION}\" />\n\
         \x20       <Parameter Name=\"Timeout\" ParamId=\"0\" ParamValue=\"{TIMEOUT_CYCLES}\" />\n\
         \x20       <Parameter Name=\"Flag\" ParamId=\"3\" ParamValue=\"1\" />\n\
         \x20       <Parameter Name=\"Precision\" ParamId=\"7\" ParamValue=\"{DECIMALS}\" />\n\
         \x20     </Parameters>\n\
         \x20   </RsiObject>\n\
         \x20 </RsiObjects>\n\
         </RsiContext>\n"
    )
}

fn rsi_xml(input: Option<u16>) -> String {
    let (object, wire) = input.map_or_else(Default::default, |number| {
        (
            format!(
                "\x20 <RSIObject ObjType=\"DIGIN\" ObjTypeID=\"29\" ObjID=\"DIGIN1\">\n\
                 \x20   <Parameters>\n\
                 \x20     <Parameter Name=\"Index\" ParamID=\"1\" ParamValue=\"{number}\" />\n\
                 \x20     <Parameter Name=\"DataSize\" ParamID=\"2\" ParamValue=\"{BIT}\" />\n\
                 \x20   </Parameters>\n\
                 \x20 </RSIObject>\n"
            ),
            "\x20   <Inputs>\n\
             \x20     <Input InIdx=\"1\" OutObjID=\"DIGIN1\" OutIdx=\"1\" />\n\
             \x20   </Inputs>\n",
        )
    });
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n\
         <RSIObjects xsi:noNamespaceSchemaLocation=\"/Roboter/Config/System/Common/Schemes/RSIContext.xsd\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">\n{object}\
         \x20 <RSIObject ObjType=\"ETHERNET\" ObjTypeID=\"64\" ObjID=\"ETHERNET1\">\n{wire}\
         \x20   <Parameters>\n\
         \x20     <Parameter Name=\"ConfigFile\" ParamID=\"1\" ParamValue=\"{CONFIGURATION}\" IsRuntime=\"false\" />\n\
         \x20     <Parameter Name=\"Timeout\" ParamID=\"1\" ParamValue=\"{TIMEOUT_CYCLES}\" />\n\
         \x20     <Parameter Name=\"Flag\" ParamID=\"4\" ParamValue=\"1\" />\n\
         \x20     <Parameter Name=\"Precision\" ParamID=\"8\" ParamValue=\"{DECIMALS}\" />\n\
         \x20   </Parameters>\n\
         \x20 </RSIObject>\n\
         </RSIObjects>\n"
    )
}

/// The same for the editor: the limits are those within which it takes a value.
fn rsi_model(input: Option<u16>) -> String {
    let (object, wire) = input.map_or_else(Default::default, |number| {
        let index = whole_parameter("Index", number, [1, 4096], 1);
        (
            format!(
                "\x20   <rSIElement name=\"DIGIN1\" objType=\"DIGIN\" objTypeID=\"29\" maxInputs=\"0\" maxOutputs=\"0\">\n\
                 \x20     <rSIOutPorts>\n\
                 \x20       <rSIOutPort name=\"Out1\" signalType=\"Int\" />\n\
                 \x20     </rSIOutPorts>\n\
                 \x20     <rSIParameters>\n{index}\
                 \x20       <rSIParameter name=\"DataSize\" value=\"Bit\" paramType=\"KUKA.RSIVisual.RSI_DataSize\" \
                 minVal=\"-2147483648\" maxVal=\"2147483647\" isEnum=\"true\" index=\"2\" />\n\
                 \x20     </rSIParameters>\n\
                 \x20   </rSIElement>\n"
            ),
            "\x20     <rSIInPorts>\n\
             \x20       <rSIInPort name=\"In1\" mandatory=\"false\">\n\
             \x20         <source>\n\
             \x20           <rSIOutPortMoniker name=\"//DIGIN1/Out1\" />\n\
             \x20         </source>\n\
             \x20       </rSIInPort>\n\
             \x20     </rSIInPorts>\n",
        )
    });
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
         <rSIModel dslVersion=\"1.0.0.0\" name=\"\" xmlns=\"http://schemas.microsoft.com/dsltools/RSIVisual\">\n\
         \x20 <rSIObjects>\n{object}\
         \x20   <rSIElement name=\"ETHERNET1\" objType=\"ETHERNET\" objTypeID=\"64\" maxInputs=\"64\" maxOutputs=\"64\">\n{wire}\
         \x20     <rSIParameters>\n\
         \x20       <rSIParameter name=\"ConfigFile\" value=\"{CONFIGURATION}\" paramType=\"System.FileName\" \
         minVal=\"-2147483648\" maxVal=\"2147483647\" isEnum=\"false\" isRuntime=\"false\" index=\"1\" />\n\
         {}{}{}\
         \x20     </rSIParameters>\n\
         \x20   </rSIElement>\n\
         \x20 </rSIObjects>\n\
         </rSIModel>\n",
        whole_parameter("Timeout", TIMEOUT_CYCLES.into(), [0, 2_147_483_647], 1),
        whole_parameter("Flag", 1, [-1, 999], 4),
        whole_parameter("Precision", DECIMALS.into(), [1, 32], 8),
    )
}

fn whole_parameter(name: &str, value: u16, [least, most]: [i64; 2], index: u8) -> String {
    format!(
        "\x20       <rSIParameter name=\"{name}\" value=\"{value}\" paramType=\"System.Int32\" minVal=\"{least}\" \
         maxVal=\"{most}\" isEnum=\"false\" index=\"{index}\" />\n"
    )
}
