/* A stand-in for a device of Video4Linux, for machines without one: answers what a program asks of /dev/video-stand-in, by the kernel's own header.
 *
 *     cc -shared -fPIC -o video_device.so video_device.c -ldl
 *     VIDEO_FORMAT=GREY LD_PRELOAD=./video_device.so program
 *
 * Buffers and states are as the kernel's documentation has them: what a program does wrong is refused as there, and counted. When it
 * closes the device, its record is written to the file VIDEO_LOG. A frame n of columns x and rows y has the level x + 3 y + n.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#define DEVICE "/dev/video-stand-in"
#define MOST 8
#define PADDING 16

static int device = -1, streaming, count, violations, dequeued;
static unsigned width = 64, height = 48, format, stride, size_image, sequence;
static struct { unsigned char *at; int queued; } buffers[MOST];
static int order[MOST], waiting;
static long exposure = 157, automatic = 3, period_ms = 20;

static long setting(const char *name, long otherwise) {
    const char *text = getenv(name);
    return text ? atol(text) : otherwise;
}

static void lay_out(void) {
    unsigned bytes = format == V4L2_PIX_FMT_GREY || format == V4L2_PIX_FMT_SRGGB8 ? 1 : 2;
    stride = width * bytes + PADDING;
    size_image = stride * height;
}

static int fail(int error) { errno = error; return -1; }

static int wrong(void) { violations++; return fail(EINVAL); }

static int open_device(void) {
    const char *code = getenv("VIDEO_FORMAT");
    if (!code) code = "GREY";
    char four[5] = "    ";
    memcpy(four, code, strlen(code) < 4 ? strlen(code) : 4);
    format = v4l2_fourcc(four[0], four[1], four[2], four[3]);
    lay_out();
    device = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    return device;
}

static void fill(unsigned char *to, unsigned number) {
    for (unsigned y = 0; y < height; y++) {
        unsigned char *line = to + (size_t)y * stride;
        memset(line, 0xee, stride);
        for (unsigned x = 0; x < width; x++) {
            unsigned level = x + 3 * y + number;
            if (format == V4L2_PIX_FMT_GREY || format == V4L2_PIX_FMT_SRGGB8) line[x] = level & 255;
            else if (format == V4L2_PIX_FMT_YUYV) { line[2 * x] = level & 255; line[2 * x + 1] = 128; }
            else { line[2 * x] = level & 255; line[2 * x + 1] = (level >> 8) & 3; }
        }
    }
}

static int formats(struct v4l2_fmtdesc *asked) {
    static const unsigned known[] = { V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y10, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_SRGGB8 };
    if (asked->type != V4L2_BUF_TYPE_VIDEO_CAPTURE || asked->index >= sizeof known / sizeof *known) return fail(EINVAL);
    asked->pixelformat = known[asked->index];
    strcpy((char *)asked->description, "stand-in");
    return 0;
}

static int is_known(unsigned code) {
    struct v4l2_fmtdesc each = { .type = V4L2_BUF_TYPE_VIDEO_CAPTURE };
    for (; formats(&each) == 0; each.index++) if (each.pixelformat == code) return 1;
    return 0;
}

static int get_format(struct v4l2_format *asked) {
    if (asked->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return wrong();
    asked->fmt.pix.width = width, asked->fmt.pix.height = height, asked->fmt.pix.pixelformat = format;
    asked->fmt.pix.bytesperline = stride, asked->fmt.pix.sizeimage = size_image;
    asked->fmt.pix.field = V4L2_FIELD_NONE;
    return 0;
}

static int set_format(struct v4l2_format *asked) {
    if (asked->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return wrong();
    if (count) { violations++; return fail(EBUSY); }
    /* What is not offered becomes something that is; so does a size. */
    if (is_known(asked->fmt.pix.pixelformat)) format = asked->fmt.pix.pixelformat;
    lay_out();
    return get_format(asked);
}

static int request(struct v4l2_requestbuffers *asked) {
    if (asked->type != V4L2_BUF_TYPE_VIDEO_CAPTURE || asked->memory != V4L2_MEMORY_MMAP) return wrong();
    if (streaming) { violations++; return fail(EBUSY); }
    if (asked->count > MOST) asked->count = MOST;
    count = asked->count;
    waiting = 0;
    memset(buffers, 0, sizeof buffers);
    return 0;
}

static int query(struct v4l2_buffer *asked) {
    if ((int)asked->index >= count) return wrong();
    asked->length = size_image;
    asked->m.offset = asked->index * 0x100000;
    return 0;
}

static int enqueue(struct v4l2_buffer *asked) {
    if ((int)asked->index >= count || asked->memory != V4L2_MEMORY_MMAP) return wrong();
    if (!buffers[asked->index].at || buffers[asked->index].queued) return wrong();
    buffers[asked->index].queued = 1;
    order[waiting++] = asked->index;
    return 0;
}

static int dequeue(struct v4l2_buffer *asked) {
    uint64_t ticks;
    if (!streaming) return wrong();
    long gone = setting("VIDEO_GONE_AFTER", -1);
    if (gone >= 0 && dequeued >= gone) return fail(ENODEV);
    if (read(device, &ticks, sizeof ticks) != sizeof ticks) return fail(EAGAIN);
    /* Pictures that nobody fetched were lost: the kernel's number goes on. */
    sequence += (unsigned)ticks - 1;
    if (!waiting) return fail(EAGAIN);
    int index = order[0];
    memmove(order, order + 1, sizeof *order * (size_t)--waiting);
    buffers[index].queued = 0;
    fill(buffers[index].at, sequence);
    const char *stamp = getenv("VIDEO_STAMP");
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    int64_t ns = now.tv_sec * 1000000000LL + now.tv_nsec;
    unsigned flags = V4L2_BUF_FLAG_MAPPED;
    if (stamp && !strcmp(stamp, "soe")) { flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE; ns -= 30000000; }
    else if (stamp && !strcmp(stamp, "copy")) flags |= V4L2_BUF_FLAG_TIMESTAMP_COPY;
    else { flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF; ns -= 5000000; }
    asked->index = index, asked->flags = flags, asked->bytesused = size_image, asked->length = size_image;
    asked->timestamp.tv_sec = ns / 1000000000, asked->timestamp.tv_usec = ns % 1000000000 / 1000;
    asked->sequence = sequence++, asked->field = V4L2_FIELD_NONE, asked->memory = V4L2_MEMORY_MMAP;
    if (dequeued == setting("VIDEO_SHORT_AT", -1)) asked->bytesused = size_image / 2;
    if (dequeued == setting("VIDEO_ERROR_AT", -1)) asked->flags |= V4L2_BUF_FLAG_ERROR;
    dequeued++;
    return 0;
}

static int stream(int on) {
    if (on && !waiting) return wrong();
    streaming = on;
    waiting = on ? waiting : 0;
    struct itimerspec every = { { 0, on ? period_ms * 1000000 : 0 }, { 0, on ? period_ms * 1000000 : 0 } };
    return timerfd_settime(device, 0, &every, NULL);
}

static long *control(unsigned id) {
    if (id == V4L2_CID_EXPOSURE_AUTO) return &automatic;
    if (id == V4L2_CID_EXPOSURE_ABSOLUTE) return &exposure;
    return NULL;
}

static int controls(struct v4l2_ext_controls *asked, int set) {
    for (unsigned k = 0; k < asked->count; k++) {
        struct v4l2_ext_control *each = asked->controls + k;
        long *value = control(each->id);
        if (!value) return fail(EINVAL);
        /* Exposure by hand only, as drivers of UVC have it. */
        if (set && value == &exposure && automatic != V4L2_EXPOSURE_MANUAL) return wrong();
        if (set) *value = each->value; else each->value = (int)*value;
    }
    return 0;
}

static int answer(unsigned long asked, void *with) {
    switch (asked) {
    case VIDIOC_QUERYCAP: {
        struct v4l2_capability *can = with;
        memset(can, 0, sizeof *can);
        strcpy((char *)can->driver, "stand-in"), strcpy((char *)can->card, "Stand-in"), strcpy((char *)can->bus_info, "usb-0");
        can->capabilities = can->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        return 0;
    }
    case VIDIOC_ENUM_FMT: return formats(with);
    case VIDIOC_G_FMT: return get_format(with);
    case VIDIOC_S_FMT: return set_format(with);
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM: {
        struct v4l2_streamparm *rate = with;
        struct v4l2_fract *time = &rate->parm.capture.timeperframe;
        if (asked == VIDIOC_S_PARM && time->denominator) period_ms = 1000 * time->numerator / time->denominator;
        /* No slower than every 40 ms. */
        if (period_ms > 40) period_ms = 40;
        time->numerator = (unsigned)period_ms, time->denominator = 1000;
        return 0;
    }
    case VIDIOC_QUERY_EXT_CTRL: {
        struct v4l2_query_ext_ctrl *kind = with;
        if (!control(kind->id)) return fail(EINVAL);
        kind->type = kind->id == V4L2_CID_EXPOSURE_AUTO ? V4L2_CTRL_TYPE_MENU : V4L2_CTRL_TYPE_INTEGER;
        return 0;
    }
    case VIDIOC_G_EXT_CTRLS: return controls(with, 0);
    case VIDIOC_S_EXT_CTRLS: return controls(with, 1);
    case VIDIOC_REQBUFS: return request(with);
    case VIDIOC_QUERYBUF: return query(with);
    case VIDIOC_QBUF: return enqueue(with);
    case VIDIOC_DQBUF: return dequeue(with);
    case VIDIOC_STREAMON: return stream(1);
    case VIDIOC_STREAMOFF: return stream(0);
    default: return fail(ENOTTY);
    }
}

static void tell(void) {
    const char *file = getenv("VIDEO_LOG");
    FILE *log = file ? fopen(file, "w") : NULL;
    if (!log) return;
    fprintf(log, "violations=%d buffers=%d streaming=%d dequeued=%d automatic=%ld exposure=%ld period_ms=%ld\n", violations, count, streaming,
            dequeued, automatic, exposure, period_ms);
    fclose(log);
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return strcmp(path, DEVICE) ? NEXT(open)(path, flags, mode) : open_device();
}

int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return strcmp(path, DEVICE) ? NEXT(open64)(path, flags, mode) : open_device();
}

long syscall(long number, ...) {
    va_list rest;
    va_start(rest, number);
    long a = va_arg(rest, long), b = va_arg(rest, long), c = va_arg(rest, long), d = va_arg(rest, long), e = va_arg(rest, long),
         f = va_arg(rest, long);
    va_end(rest);
    if (number == SYS_ioctl && device >= 0 && (int)a == device) return answer((unsigned long)b, (void *)c);
    return NEXT(syscall)(number, a, b, c, d, e, f);
}

int ioctl(int fd, unsigned long asked, ...) {
    va_list rest;
    va_start(rest, asked);
    void *with = va_arg(rest, void *);
    va_end(rest);
    if (device >= 0 && fd == device) return answer(asked, with);
    return (int)NEXT(syscall)(SYS_ioctl, fd, asked, with);
}

static void *map(void *at, size_t length, int protection, int flags, int fd, off_t offset) {
    if (device < 0 || fd != device) return NULL;
    void *memory = (void *)NEXT(mmap)(at, length, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (offset / 0x100000 < MOST) buffers[offset / 0x100000].at = memory;
    (void)flags;
    return memory;
}

void *mmap(void *at, size_t length, int protection, int flags, int fd, off_t offset) {
    void *memory = map(at, length, protection, flags, fd, offset);
    return memory ? memory : NEXT(mmap)(at, length, protection, flags, fd, offset);
}

void *mmap64(void *at, size_t length, int protection, int flags, int fd, off64_t offset) {
    void *memory = map(at, length, protection, flags, fd, offset);
    return memory ? memory : NEXT(mmap64)(at, length, protection, flags, fd, offset);
}

int close(int fd) {
    if (device >= 0 && fd == device) { tell(); device = -1; }
    return NEXT(close)(fd);
}
