/* Stereo matching by belief propagation: two rectified images in, a disparity map out. Made by cbindgen; do not edit. */

#ifndef BPSTEREO_H
#define BPSTEREO_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/**
 * The outcome of a call. All but `BPSTEREO_STATUS_OK` are failures, sorted by who can fix them.
 */
typedef enum BpstereoStatus {
  /**
   * Success.
   */
  BPSTEREO_STATUS_OK = 0,
  /**
   * Options that contradict each other, are unknown or impossible.
   */
  BPSTEREO_STATUS_OPTIONS = 1,
  /**
   * Images or pointers that cannot be used.
   */
  BPSTEREO_STATUS_INPUT = 2,
  /**
   * A backend or device that does not exist or cannot be opened.
   */
  BPSTEREO_STATUS_UNAVAILABLE = 3,
  /**
   * A device that is too small for the plan.
   */
  BPSTEREO_STATUS_UNSUPPORTED = 4,
  /**
   * A device that was lost during the work: open a new matcher.
   */
  BPSTEREO_STATUS_DEVICE_LOST = 5,
  /**
   * More memory is needed than is allowed or free.
   */
  BPSTEREO_STATUS_MEMORY = 6,
  /**
   * The system or a driver failed.
   */
  BPSTEREO_STATUS_SYSTEM = 7,
  /**
   * `bpstereo_stop` was called.
   */
  BPSTEREO_STATUS_STOPPED = 8,
  /**
   * A defect of this library. Close the matcher.
   */
  BPSTEREO_STATUS_DEFECT = 9,
} BpstereoStatus;

/**
 * The type of an image's values.
 */
typedef enum BpstereoValue {
  /**
   * uint8_t.
   */
  BPSTEREO_VALUE_U8 = 0,
  /**
   * uint16_t; 65535 is white.
   */
  BPSTEREO_VALUE_U16 = 1,
  /**
   * float, from 0 to 1 or from 0 to 255.
   */
  BPSTEREO_VALUE_F32 = 2,
} BpstereoValue;

/**
 * A matcher: a device, opened once, and what it prepared for pairs of the last size. It matches one pair at a time.
 */
typedef struct BpstereoMatcher BpstereoMatcher;

/**
 * An image in the caller's memory. It is read during the call only.
 */
typedef struct BpstereoImage {
  /**
   * The first value of the upper left pixel, aligned as its type needs.
   */
  const void *data;
  /**
   * The type of the values: `BPSTEREO_VALUE_U8`, `BPSTEREO_VALUE_U16` or `BPSTEREO_VALUE_F32`.
   */
  uint32_t value_type;
  /**
   * Columns.
   */
  size_t width;
  /**
   * Rows.
   */
  size_t height;
  /**
   * Values of a pixel, one after another: 1 for grey, 3 for red, green and blue.
   */
  size_t channels;
  /**
   * Bytes from one row to the next; negative if the last row comes first in memory. A multiple of the type's size.
   */
  ptrdiff_t stride;
} BpstereoImage;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The message of the last call that failed in this thread, in UTF-8. Valid until the next failure in this thread. Empty if
 * nothing failed yet.
 */
const char *bpstereo_last_error(void);

/**
 * The version of this library, such as "0.1.0".
 */
const char *bpstereo_version(void);

/**
 * Opens a matcher.
 *
 * `options` is a JSON object of the library's options in UTF-8, such as {"labels": {"count": 64}, "check": true}; null or
 * "" means all defaults. Stores the matcher in `*matcher`, or null if it fails.
 *
 * # Safety
 * `options` must be null or a string that ends in 0, and `matcher` null or a valid place for a pointer.
 */
enum BpstereoStatus bpstereo_open(const char *options,
                                  struct BpstereoMatcher **matcher);

/**
 * Matches a rectified pair of images of one size.
 *
 * Writes the disparities of the left image in pixels to `disparity`, `[height][width]`, NaN where they are unknown; its rows
 * are `stride` bytes apart. Writes the confidence of each pixel, 0 to 1, to `confidence` in the same way. This needs the option
 * "confidence"; without it, `confidence` must be null.
 *
 * # Safety
 * `matcher` must be null or come from `bpstereo_open`. The images must be readable, and the buffers writable, as described.
 */
enum BpstereoStatus bpstereo_compute(const struct BpstereoMatcher *matcher,
                                     const struct BpstereoImage *left,
                                     const struct BpstereoImage *right,
                                     float *disparity,
                                     float *confidence,
                                     ptrdiff_t stride);

/**
 * The last answer without its map, as a JSON object: "times" in seconds, "energy" (null unless the option "energy" is true),
 * "settings" and "warnings". Valid until the matcher is used again; empty before the first match, after one that failed,
 * and while the matcher is at work.
 *
 * # Safety
 * `matcher` must be null or come from `bpstereo_open`.
 */
const char *bpstereo_answer(const struct BpstereoMatcher *matcher);

/**
 * Ends the match that runs at its next step, or the next one at its beginning, with `BPSTEREO_STATUS_STOPPED`. May be called
 * from any thread.
 *
 * # Safety
 * `matcher` must be null or come from `bpstereo_open`, and not be closed meanwhile.
 */
void bpstereo_stop(const struct BpstereoMatcher *matcher);

/**
 * Closes a matcher and its device. Null is ignored.
 *
 * # Safety
 * `matcher` must be null or come from `bpstereo_open`, and not be used afterwards.
 */
void bpstereo_close(struct BpstereoMatcher *matcher);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BPSTEREO_H */
