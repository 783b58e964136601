//! The kinematic chain: from the posture of the axes to the pose of the tool in the part.
//!
//! In: a checked machine, a posture. Out: [`JointPath`] of a contour piece, [`ToolPose`] of a posture.
//!
//! Table joints `J_1 .. J_n` stand between the machine base and the part, head joints `H_1 .. H_m` between the slide that X, Y
//! and Z move and the tool. Each turns what it carries about a fixed direction through a fixed point; part zero is machine zero
//! and the tool points along +Z with its tip at the slide's reference where all angles are 0. A part point p is at
//! `J_1 .. J_n p` in the machine, the tool tip at `XYZ + H_1 .. H_m 0`, so that (models/five-axis.md section 2,
//! models/feed-prediction-and-surface.md section 1)
//!
//! ```text
//! pose of the tool in the part = (J_1 .. J_n)^-1  translation(XYZ)  H_1 .. H_m  translation(-L)
//! ```
//!
//! with the length L of the tool (position of the axes minus position of the tip, head at 0). Does not solve the inverse problem.

use super::JointPath;
use crate::base::Portable;
use crate::base::{AxisId, AxisVector, MachinePoint};
use crate::machine::{KinematicsSettings, Machine, RotaryJoint};
use crate::smoothing::ContourPiece;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Shorter than this a direction is none; checked machines have unit vectors.
const DIRECTION_MIN_RATIO: f64 = 1e-12;

/// The chain of one machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics {
    pub(super) geometry_axes: [Option<AxisId>; 3],
    pub(super) table: Vec<Joint>,
    pub(super) head: Vec<Joint>,
}

/// Unit vector, dimensionless.
pub type Direction = [f64; 3];

/// Unit quaternion x, y, z, w, dimensionless.
pub type Quaternion = [f64; 4];

/// Pose of the tool in the part frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolPose {
    /// Tool tip.
    pub position_mm: [f64; 3],
    /// Unit vector from the tip towards the spindle.
    pub axis: Direction,
    /// Rotation that takes the tool's own frame (+Z = axis) into the part frame. Continuous in the angles, so that it changes sign
    /// with every turn.
    pub orientation_quaternion_xyzw: Quaternion,
}

/// A rotary joint of the chain.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Joint {
    pub(super) axis: AxisId,
    pub(super) direction: Unit<Vector3<f64>>,
    pub(super) point: Point3<f64>,
}

impl Kinematics {
    /// Chain of `machine`. The axes named X, Y and Z move the tool along the axes of the frame.
    pub fn new(machine: &Machine) -> Self {
        let joints = |settings: &[RotaryJoint]| settings.iter().filter_map(Joint::new).collect();
        let (table, head) = match &machine.kinematics {
            KinematicsSettings::Cartesian => (Vec::new(), Vec::new()),
            KinematicsSettings::Rotary { table, head } => (joints(table), joints(head)),
        };
        Self { geometry_axes: ["X", "Y", "Z"].map(|name| machine.axis_by_name(name)), table, head }
    }

    /// The motion of the axes that drives a piece of contour, without a transformation.
    pub fn to_joint(&self, piece: ContourPiece) -> JointPath {
        JointPath { contour: piece, transformation: None }
    }

    /// Pose of a tool without length when the axes stand at `posture`.
    pub fn tool_pose(&self, posture: &MachinePoint) -> ToolPose {
        self.tip_pose(posture, &AxisVector::zero())
    }

    /// Pose of the tool when the axes stand at `posture`. `length`: position of the axes minus position of the tip, with the head at 0.
    pub fn tip_pose(&self, posture: &MachinePoint, length: &AxisVector) -> ToolPose {
        let [length_x_mm, length_y_mm, length_z_mm] =
            self.geometry_axes.map(|axis| axis.map_or(0.0, |axis| length[axis]));
        let [x, y, z] = self.geometry_axes.map(|axis| axis.map_or(0.0, |axis| posture.0[axis]));
        let chain = |joints: &[Joint]| {
            joints.iter().fold(Isometry3::identity(), |carried, joint| carried * joint.turned(posture.0[joint.axis]))
        };
        let pose = chain(&self.table).inverse() * Translation3::new(x, y, z) * chain(&self.head);
        let pose = pose * Translation3::new(-length_x_mm, -length_y_mm, -length_z_mm);
        // The product of unit quaternions drifts from length 1 by rounding only, but a recording is read by strangers.
        let rotation = UnitQuaternion::new_normalize(pose.rotation.into_inner());
        let axis = rotation * Vector3::z();
        ToolPose {
            position_mm: pose.translation.vector.into(),
            axis: axis.into(),
            orientation_quaternion_xyzw: rotation.coords.into(),
        }
    }
}

impl Joint {
    fn new(settings: &RotaryJoint) -> Option<Self> {
        let direction = Unit::try_new(Vector3::from(settings.direction), DIRECTION_MIN_RATIO)?;
        Some(Self { axis: settings.axis, direction, point: Point3::from(settings.point_mm) })
    }

    /// Right-handed rotation about the joint's own line.
    fn turned(&self, angle_rad: f64) -> Isometry3<f64> {
        // As `UnitQuaternion::from_axis_angle` has it, with the sine of this program.
        let (sin, cos) = (angle_rad / 2.0).portable_sin_cos();
        let turn =
            UnitQuaternion::new_unchecked(nalgebra::Quaternion::from_parts(cos, self.direction.into_inner() * sin));
        Isometry3::rotation_wrt_point(turn, self.point)
    }
}
