/* Matches two grey images, binary PGM files of 8 bits, and prints the disparity at the centre.
 * cc match.c $(pkg-config --cflags --libs bpstereo) -o match && ./match left.pgm right.pgm */
#include <bpstereo.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static BpstereoImage read_pgm(const char *path) {
    BpstereoImage image = {NULL, BPSTEREO_VALUE_U8, 0, 0, 1, 0};
    FILE *file = fopen(path, "rb");
    unsigned most = 0;
    if (file && fscanf(file, "P5 %zu %zu %u", &image.width, &image.height, &most) == 3 && most == 255 && fgetc(file) != EOF) {
        void *pixels = calloc(image.height, image.width);
        if (pixels && fread(pixels, image.width, image.height, file) == image.height)
            image.data = pixels;
        else
            free(pixels);
        image.stride = (ptrdiff_t)image.width;
    }
    if (file)
        fclose(file);
    return image;
}

int main(int count, char **arguments) {
    if (count != 3)
        return fprintf(stderr, "usage: match left.pgm right.pgm\n"), 2;
    BpstereoImage left = read_pgm(arguments[1]), right = read_pgm(arguments[2]);
    size_t stride = left.width * sizeof(float);
    float *disparity = calloc(left.height + 1, stride + 1);
    BpstereoMatcher *matcher = NULL;
    BpstereoStatus status = bpstereo_open("{\"check\": true}", &matcher);
    if (status == BPSTEREO_STATUS_OK)
        status = bpstereo_compute(matcher, &left, &right, disparity, NULL, (ptrdiff_t)stride);
    if (status == BPSTEREO_STATUS_OK)
        printf("%.2f px at the centre\n", disparity[left.height / 2 * left.width + left.width / 2]);
    else
        fprintf(stderr, "match: %s\n", bpstereo_last_error());
    bpstereo_close(matcher);
    free((void *)left.data);
    free((void *)right.data);
    free(disparity);
    return status;
}
