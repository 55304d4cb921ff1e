/* trueline_rt.h: where the sensor was when the light fell, while it runs.
 *
 * Metre, radian, second; stamps are nanoseconds of one clock. Transforms are named a_from_b. Quaternions are w, x, y, z.
 * A handle belongs to one thread at a time. Memory is allocated by the functions that end in _new alone; no function waits.
 * Every function returns a trueline_status unless it says otherwise; trueline_status_text gives it in words. */
#ifndef TRUELINE_RT_H
#define TRUELINE_RT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when a struct or a function does. */
#define TRUELINE_RT_ABI 2

typedef int32_t trueline_status;
#define TRUELINE_OK 0
#define TRUELINE_NULL_POINTER 1      /* a pointer that is needed is null, or an array not aligned */
#define TRUELINE_BAD_SETTING 2       /* a number of calibration or settings is not finite or out of range */
#define TRUELINE_NOT_FINITE 3        /* a pose, a point or a stamp is not a finite number in range */
#define TRUELINE_NOT_LATER 4         /* the pose is not later than the last one, and not taken */
#define TRUELINE_CLOCK_WENT_BACK 5   /* the poses before are forgotten; this one is taken */
#define TRUELINE_UNSETTLED 6         /* too few poses or frames yet */
#define TRUELINE_STAMP_JUMPED 7      /* the frame's stamp does not fit its clock */
#define TRUELINE_NO_POSE 8           /* the exposure is before the poses, or in a gap between them */
#define TRUELINE_DOUBTFUL_POSES 9    /* the poses about the exposure are no motion of a robot */
#define TRUELINE_POSES_ENDED 10      /* the poses end before the exposure, by more than is predicted */
#define TRUELINE_OTHER_SENSOR 11     /* the sensor does not report such points */
#define TRUELINE_OFF_SEAM 12         /* the seam point is off the seam or not further along it, and not taken */
#define TRUELINE_ANOTHER_SEAM 13     /* another seam begins with this point; the points before are forgotten */
#define TRUELINE_NO_SEAM 14          /* there are too few seam points about the place, or it is beyond them */
#define TRUELINE_PANIC 15            /* a defect of the library; the handle must be freed */
#define TRUELINE_NO_AXIS 16          /* there is no such external axis */
#define TRUELINE_NO_AXIS_VALUE 17    /* an external axis has no value at the exposure, or a doubtful one */

/* What the sensor reports. */
#define TRUELINE_PROFILER 0     /* (x, z), m */
#define TRUELINE_CAMERA_LASER 1 /* (u, v), px */
#define TRUELINE_POINTS 2       /* (x, y, z) in the camera frame, m */

/* What carries the sensor. */
#define TRUELINE_ON_TOOL 0
#define TRUELINE_FIXED 1 /* the robot carries the part: points come out in the frame of the tool */

/* How an external axis moves, and what it moves. */
#define TRUELINE_ROTARY 0
#define TRUELINE_LINEAR 1
#define TRUELINE_CARRIES_PART 0 /* points come out in the frame of the part, as it lies with the axis at zero */
#define TRUELINE_CARRIES_ROBOT 1
#define TRUELINE_CARRIES_SENSOR 2

/* What a stream's stamps are. */
#define TRUELINE_AS_STAMPED 0
#define TRUELINE_LOWER_ENVELOPE 1

/* When the points of one frame are exposed, after the first of them. */
#define TRUELINE_AT_ONCE 0
#define TRUELINE_BY_INDEX 1
#define TRUELINE_BY_ROW 2
#define TRUELINE_BY_COLUMN 3

typedef struct {
    double translation_m[3];
    double rotation_wxyz[4];
} trueline_pose;

typedef struct {
    int32_t sensor;
    int32_t carrier;
    int32_t has_plane; /* for TRUELINE_POINTS; TRUELINE_CAMERA_LASER always has one */
    int32_t has_shape;
    uint32_t image_size_px[2];
    double focal_px[2];
    double centre_px[2];
    double distortion[5]; /* k1, k2, p1, p2, k3 */
    double plane_normal[3];
    double plane_offset_m;
    double shape_h[5]; /* h1, h2, h3; h4 and h5 per m */
    double shape_origin_m[2];
    trueline_pose tool_from_camera;
    double time_offset_s; /* the image stamped t was exposed at t - time_offset_s */
    double covariance[49]; /* of time offset (s), rotation (rad), translation (m) */
    double reading_sigma_m;
} trueline_calibration;

typedef struct {
    int32_t pose_stamps;
    int32_t frame_stamps;
    int32_t readout;
    uint32_t poses_kept; /* and values of each external axis */
    int32_t axis_stamps;
    int32_t reserved; /* 0 */
    double readout_step_s;
    double stamp_sigma_s;
    double half_window_s;
    double longest_prediction_s;
    double acceleration_m_s2;
    double angular_acceleration_rad_s2;
    double fastest_m_s;
    double fastest_rad_s;
} trueline_settings;

/* An external axis where the calibration found it. Values are rad or m. */
typedef struct {
    int32_t kind;
    int32_t carries;
    double direction[3]; /* unit; in base, or in the tool if it carries the sensor */
    double point_m[3];   /* of a rotary axis */
    double scale;
    double time_offset_s; /* the value stamped t was true at t - time_offset_s */
    int32_t in_pose;      /* whether the robot's poses contain it already, by the numbers that follow */
    int32_t reserved;     /* 0 */
    double pose_direction[3];
    double pose_point_m[3];
    double pose_scale;
    double covariance[36]; /* of direction (2, rad) and point (2, m) square to the axis, scale, time offset (s) */
} trueline_axis;

typedef struct {
    uint64_t placed;
    uint64_t flagged; /* their coordinates are NaN and their sigma is infinite */
    int64_t exposed_ns;
    double age_s; /* negative where the pose is predicted */
} trueline_placed;

typedef struct {
    int32_t is_settled;
    int32_t is_stalled;
    double silent_s; /* NaN before the first pose */
    double pose_period_s;
    double pose_noise_m;
    double pose_noise_rad;
    double usual_late_s[2]; /* of poses, of frames */
    uint32_t jumps[2];
} trueline_health;

typedef struct {
    int32_t is_settled;
    int32_t is_stalled;
    double silent_s; /* NaN before the first value */
    double period_s;
    double noise; /* rad or m */
    uint32_t jumps;
    uint32_t reserved; /* 0 */
} trueline_axis_health;

typedef struct {
    double half_window_m;
    double longest_extrapolation_m;
    double curvature_per_m;
    double jump_m;
    uint32_t points_kept;
    uint32_t reserved; /* 0 */
} trueline_track_settings;

/* Where a torch is to be. It is advice: whoever moves the robot checks it. */
typedef struct {
    trueline_pose base_from_torch;
    double along_m;
    double tangent[3];
    double across[3];
    double upward[3];
    double sigma_m;
    double off_m[2]; /* how far off the seam the torch is now, along across and upward */
} trueline_target;

typedef struct trueline_placer trueline_placer;
typedef struct trueline_seam_track trueline_seam_track;

/* TRUELINE_RT_ABI of the library. */
uint32_t trueline_rt_abi(void);
/* A status in words; never null. */
const char *trueline_status_text(trueline_status status);

trueline_status trueline_settings_default(trueline_settings *settings);
trueline_status trueline_placer_new(const trueline_calibration *calibration, const trueline_settings *settings,
                                    trueline_placer **placer);
/* The same for a cell with external axes, from the base outward; they are numbered from 0. */
trueline_status trueline_placer_new_with_axes(const trueline_calibration *calibration, const trueline_axis *axes,
                                              size_t axis_count, const trueline_settings *settings,
                                              trueline_placer **placer);
/* Null is allowed. */
void trueline_placer_free(trueline_placer *placer);
trueline_status trueline_placer_push_pose(trueline_placer *placer, int64_t stamp_ns,
                                          const trueline_pose *base_from_tool);
/* Angle (rad) or way (m) of an external axis. Without values up to the exposure no frame is placed. */
trueline_status trueline_placer_push_axis(trueline_placer *placer, uint32_t axis, int64_t stamp_ns, double value);
trueline_status trueline_placer_axis_health(const trueline_placer *placer, uint32_t axis, int64_t now_ns,
                                            trueline_axis_health *health);
/* Places count points: 2 numbers each of a profiler or a camera, 3 of TRUELINE_POINTS; writes 3 numbers each to base_points_m and one to
 * sigma_m. If the frame is refused they are NaN and infinite. placed may be null. */
trueline_status trueline_placer_place(trueline_placer *placer, int64_t stamp_ns, const double *points, size_t count,
                                      double *base_points_m, double *sigma_m, trueline_placed *placed);
trueline_status trueline_placer_health(const trueline_placer *placer, int64_t now_ns, trueline_health *health);

trueline_status trueline_track_settings_default(trueline_track_settings *settings);
trueline_status trueline_seam_track_new(const trueline_track_settings *settings, trueline_seam_track **track);
/* Null is allowed. */
void trueline_seam_track_free(trueline_seam_track *track);
trueline_status trueline_seam_track_clear(trueline_seam_track *track);
/* A seam point in base (3 numbers), m, and its sigma. */
trueline_status trueline_seam_track_push(trueline_seam_track *track, const double *point_m, double sigma_m);
trueline_status trueline_seam_track_ahead(const trueline_seam_track *track, const trueline_pose *base_from_torch,
                                          double speed_m_s, double delay_s, trueline_target *target);

#ifdef __cplusplus
}
#endif

#endif
