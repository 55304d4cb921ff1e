// Follows a seam: c++ follow.cpp -ltrueline_rt_c -lm -lpthread -ldl
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <memory>

#include "trueline_rt.h"

namespace {

struct Free {
    void operator()(trueline_seam_track *track) const { trueline_seam_track_free(track); }
};
using Track = std::unique_ptr<trueline_seam_track, Free>;

Track make_track() {
    trueline_track_settings settings;
    trueline_track_settings_default(&settings);
    trueline_seam_track *track = nullptr;
    trueline_seam_track_new(&settings, &track);
    return Track(track);
}

void print_bits(double number) {
    std::uint64_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    std::printf("%016" PRIx64 "\n", bits);
}

}  // namespace

int main() {
    const Track track = make_track();
    if (!track) return 1;
    for (int k = 0; k < 100; k++) {
        const double x = 0.001 * k;
        const double point[3] = {x, 2.0 * x * x, 0.1};
        if (trueline_seam_track_push(track.get(), point, 5e-5) != TRUELINE_OK) return 1;
    }
    // The torch is 30 mm along; its command acts 80 ms later, at 20 mm/s.
    const trueline_pose torch = {{0.030, 0.0018, 0.1}, {0.0, 1.0, 0.0, 0.0}};
    trueline_target target;
    const trueline_status status = trueline_seam_track_ahead(track.get(), &torch, 0.020, 0.080, &target);
    if (status != TRUELINE_OK) {
        std::fprintf(stderr, "%s\n", trueline_status_text(status));
        return 1;
    }
    for (double number : target.base_from_torch.translation_m) print_bits(number);
    for (double number : target.base_from_torch.rotation_wxyz) print_bits(number);
    print_bits(target.along_m);
    print_bits(target.sigma_m);
    // Beyond the last point nothing is known.
    std::printf("%d\n", static_cast<int>(trueline_seam_track_ahead(track.get(), &torch, 1.0, 1.0, &target)));
    return 0;
}
