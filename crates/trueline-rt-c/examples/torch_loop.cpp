// Seam tracking in a control loop, against a simulated robot: c++ torch_loop.cpp -ltrueline_rt_c -lm -lpthread -ldl
//
// A sensor 25 mm ahead of the torch sees the seam 50 times a second; its frames are stamped 17 ms late. The robot reports its pose every 4 ms
// and acts on a command 80 ms after the pose that it was computed from. The seam is an arc of 100 mm radius, the speed 20 mm/s.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <random>

#include "trueline_rt.h"

namespace {

const double kPeriod = 0.004, kFrame = 0.020, kLate = 0.017, kDelay = 0.080, kSpeed = 0.020;
const double kRadius = 0.1, kAhead = 0.025, kHeight = 0.2, kNoise = 20e-6;

// Frees a handle where its scope ends.
struct Free {
    void operator()(trueline_placer *placer) const { trueline_placer_free(placer); }
    void operator()(trueline_seam_track *track) const { trueline_seam_track_free(track); }
};

std::int64_t ns(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

// The torch on the arc, `along` metres from its begin: it looks down and turns with the seam.
trueline_pose on_seam(double along) {
    const double angle = along / kRadius;
    // Half a turn about x after the turn about z.
    return {{kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), kHeight},
            {0.0, std::cos(angle / 2.0), std::sin(angle / 2.0), 0.0}};
}

// The place of a point of the frame of `pose`.
void apply(const trueline_pose &pose, const double point[3], double out[3]) {
    const double w = pose.rotation_wxyz[0], x = pose.rotation_wxyz[1], y = pose.rotation_wxyz[2], z = pose.rotation_wxyz[3];
    const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                            {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                            {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    for (int i = 0; i < 3; i++) {
        out[i] = pose.translation_m[i];
        for (int j = 0; j < 3; j++) out[i] += r[i][j] * point[j];
    }
}

// The seam in the frame of the sensor of a torch at `pose`: the seam point kAhead in front of the torch.
void see(const trueline_pose &pose, double along, double out[3]) {
    const trueline_pose there = on_seam(along + kAhead);
    trueline_pose inverse = {{0.0, 0.0, 0.0}, {pose.rotation_wxyz[0], -pose.rotation_wxyz[1], -pose.rotation_wxyz[2], -pose.rotation_wxyz[3]}};
    double shift[3];
    for (int i = 0; i < 3; i++) shift[i] = there.translation_m[i] - pose.translation_m[i];
    apply(inverse, shift, out);
}

}  // namespace

int main() {
    // A real program fills these in from the result of `trueline calibrate`.
    trueline_calibration calibration;
    std::memset(&calibration, 0, sizeof calibration);
    calibration.sensor = TRUELINE_POINTS;
    calibration.tool_from_camera.rotation_wxyz[0] = 1.0;
    calibration.time_offset_s = kLate;
    calibration.reading_sigma_m = kNoise;
    trueline_settings settings;
    trueline_settings_default(&settings);
    trueline_placer *made = nullptr;
    if (trueline_placer_new(&calibration, &settings, &made) != TRUELINE_OK) return 1;
    const std::unique_ptr<trueline_placer, Free> placer(made);
    trueline_track_settings track_settings;
    trueline_track_settings_default(&track_settings);
    trueline_seam_track *track_made = nullptr;
    if (trueline_seam_track_new(&track_settings, &track_made) != TRUELINE_OK) return 1;
    const std::unique_ptr<trueline_seam_track, Free> track(track_made);

    std::mt19937 random(1);
    std::normal_distribution<double> noise(0.0, kNoise);
    struct Frame { double arrives, point[3]; };
    struct Command { double acts; trueline_target target; };
    std::deque<Frame> frames;
    std::deque<Command> commands;
    double worst = 0.0;
    int led = 0;
    for (int k = 0; k < 2500; k++) {
        const double now = kPeriod * k, along = kSpeed * now;
        // The robot acts on the command that is due; before the first one it follows its own program.
        trueline_pose torch = on_seam(along);
        while (!commands.empty() && commands.front().acts <= now + 1e-9) {
            const trueline_target target = commands.front().target;
            commands.pop_front();
            torch = target.base_from_torch;
            const double *p = torch.translation_m;
            const double in_plane = std::hypot(p[0], p[1] - kRadius) - kRadius, upward = p[2] - kHeight;
            worst = std::fmax(worst, std::fmax(std::fabs(in_plane), std::fabs(upward)) / target.sigma_m);
            led++;
        }
        // The cycle of a real program begins here: the newest pose, the frames that have arrived, the next command.
        if (trueline_placer_push_pose(placer.get(), ns(now), &torch) != TRUELINE_OK) return 1;
        for (; !frames.empty() && frames.front().arrives <= now; frames.pop_front()) {
            double base[3], sigma;
            // Refused while the stream is not known yet: then there is no seam point either.
            if (trueline_placer_place(placer.get(), ns(frames.front().arrives), frames.front().point, 1, base, &sigma, nullptr) != TRUELINE_OK) continue;
            trueline_seam_track_push(track.get(), base, sigma);
        }
        trueline_target target;
        if (trueline_seam_track_ahead(track.get(), &torch, kSpeed, kDelay, &target) == TRUELINE_OK)
            commands.push_back({now + kDelay, target});
        // The sensor exposes a frame, which arrives, stamped, kLate afterwards.
        if (k % static_cast<int>(kFrame / kPeriod + 0.5) == 0) {
            Frame frame = {now + kLate, {0.0, 0.0, 0.0}};
            see(torch, along, frame.point);
            for (double &number : frame.point) number += noise(random);
            frames.push_back(frame);
        }
    }
    std::printf("led %d times, worst %.1f of its own sigma\n", led, worst);
    return led > 1500 && worst < 5.0 ? 0 : 1;
}
