/* Places a profile of a moving sensor: cc place.c -ltrueline_rt_c -lm -lpthread -ldl */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "trueline_rt.h"

#define POINTS 5
#define MS INT64_C(1000000)

/* The bits of a number: two programs that print the same computed the same. */
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
    trueline_settings settings;
    trueline_placer *placer = NULL;
    trueline_placed placed;
    double points[2 * POINTS], base[3 * POINTS], sigma[POINTS];
    trueline_status status;
    int k;

    if (trueline_rt_abi() != TRUELINE_RT_ABI) return 1;
    memset(&calibration, 0, sizeof calibration);
    calibration.sensor = TRUELINE_PROFILER;
    calibration.tool_from_camera.translation_m[0] = 0.05;
    calibration.tool_from_camera.translation_m[2] = 0.1;
    calibration.tool_from_camera.rotation_wxyz[0] = 0.8;
    calibration.tool_from_camera.rotation_wxyz[3] = 0.6;
    calibration.time_offset_s = 0.017;
    for (k = 0; k < 7; k++) calibration.covariance[8 * k] = 1e-8;
    calibration.reading_sigma_m = 2e-5;
    trueline_settings_default(&settings);
    status = trueline_placer_new(&calibration, &settings, &placer);
    if (status != TRUELINE_OK) return fail("placer", status);

    for (k = 0; k < 200; k++) {
        const double t = 0.004 * k;
        trueline_pose pose = {{0.8 + 0.1 * t, 0.02 * t * t, 0.3}, {1.0, 0.0, 0.0, 0.0}};
        status = trueline_placer_push_pose(placer, 4 * MS * k, &pose);
        if (status != TRUELINE_OK) return fail("pose", status);
    }
    for (k = 0; k < POINTS; k++) {
        points[2 * k] = 0.001 * k;
        points[2 * k + 1] = 0.2 + 0.0005 * k;
    }
    status = trueline_placer_place(placer, 517 * MS, points, POINTS, base, sigma, &placed);
    if (status != TRUELINE_OK) return fail("place", status);
    printf("%" PRIu64 " %" PRIu64 " %" PRId64 "\n", placed.placed, placed.flagged, placed.exposed_ns);
    for (k = 0; k < 3 * POINTS; k++) print_bits(base[k]);
    for (k = 0; k < POINTS; k++) print_bits(sigma[k]);

    /* After the poses have ended nothing is placed. */
    status = trueline_placer_place(placer, 900 * MS, points, POINTS, base, sigma, NULL);
    printf("%d\n", (int)status);
    trueline_placer_free(placer);
    return 0;
}
