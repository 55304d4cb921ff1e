/* Places points on a part that a table turns: cc table.c -ltrueline_rt_c -lm -lpthread -ldl */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "trueline_rt.h"

#define MS INT64_C(1000000)

static void print_bits(double number) {
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    printf("%016" PRIx64 "\n", bits);
}

static int fail(const char *what, trueline_status status) {
    fprintf(stderr, "%s: %s\n", what, trueline_status_text(status));
    return 1;
}

int main(void) {
    trueline_calibration calibration;
    trueline_axis table;
    trueline_settings settings;
    trueline_placer *placer = NULL;
    const double point[2] = {0.001, 0.2};
    double base[3], sigma;
    trueline_status status;
    int k;

    memset(&calibration, 0, sizeof calibration);
    calibration.sensor = TRUELINE_PROFILER;
    calibration.tool_from_camera.translation_m[0] = 0.05;
    calibration.tool_from_camera.translation_m[2] = 0.1;
    calibration.tool_from_camera.rotation_wxyz[0] = 1.0;
    calibration.time_offset_s = 0.017;
    calibration.reading_sigma_m = 2e-5;
    /* The entry of `axes` in the result, in metres and radians. */
    memset(&table, 0, sizeof table);
    table.kind = TRUELINE_ROTARY;
    table.carries = TRUELINE_CARRIES_PART;
    table.direction[2] = 1.0;
    table.point_m[0] = 0.8;
    table.point_m[1] = 0.1;
    table.scale = 1.0;
    table.time_offset_s = 0.012;
    for (k = 0; k < 6; k++) table.covariance[7 * k] = k == 4 ? 0.0 : 1e-4 * 1e-4;
    trueline_settings_default(&settings);
    status = trueline_placer_new_with_axes(&calibration, &table, 1, &settings, &placer);
    if (status != TRUELINE_OK) return fail("placer", status);

    /* The robot stands; the table turns with 0.5 rad/s. */
    for (k = 0; k < 200; k++) {
        trueline_pose pose = {{0.8, 0.02, 0.3}, {1.0, 0.0, 0.0, 0.0}};
        status = trueline_placer_push_pose(placer, 4 * MS * k, &pose);
        if (status != TRUELINE_OK) return fail("pose", status);
        status = trueline_placer_push_axis(placer, 0, 4 * MS * k, 0.5 * 0.004 * k);
        if (status != TRUELINE_OK) return fail("axis", status);
    }
    for (k = 0; k < 5; k++) {
        status = trueline_placer_place(placer, (300 + 100 * k) * MS, point, 1, base, &sigma, NULL);
        if (status != TRUELINE_OK) return fail("place", status);
        print_bits(base[0]);
        print_bits(base[1]);
        print_bits(base[2]);
        print_bits(sigma);
    }
    printf("%d\n", (int)trueline_placer_push_axis(placer, 1, 0, 0.0));
    trueline_placer_free(placer);
    return 0;
}
