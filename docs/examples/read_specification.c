/* Evaluate a robust problem from its specification:
   cc read_specification.c -lm && ./a.out resonant.json */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char text[1 << 24];

/* Read the array of numbers of a key into out, and return how many there are. */
static int numbers(const char *key, double *out) {
    char quoted[64], *at;
    int n = 0;
    snprintf(quoted, sizeof quoted, "\"%s\": [", key);
    if (!(at = strstr(text, quoted))) { fprintf(stderr, "no %s\n", key); exit(1); }
    for (at += strlen(quoted); *at != ']'; at += *at == ',') out[n++] = strtod(at, &at);
    return n;
}

/* Return the sum over the variables from j on: coefficients run fastest in the last one. */
static double series(const double *c, const double *degree, int j, int m, const double *t, long size) {
    double sum = 0.0, before = 1.0, now = t[j];
    long part = size / ((long)degree[j] + 1);
    for (int k = 0; k <= (int)degree[j]; k++) {
        double next = 2.0 * t[j] * now - before;
        sum += before * (j + 1 < m ? series(c + k * part, degree, j + 1, m, t, part) : c[k]);
        before = now, now = next;
    }
    return sum;
}

int main(int argc, char **argv) {
    static double mean[1 << 20], variance[1 << 20], designs[1 << 12];
    double lower[32], upper[32], of_mean[32], of_variance[32], t[32];
    FILE *file = argc == 2 ? fopen(argv[1], "r") : NULL;
    if (!file || !fread(text, 1, sizeof text - 1, file)) { fprintf(stderr, "no file\n"); return 1; }
    int m = numbers("lower", lower), n = numbers("check_designs", designs) / m;
    int a = numbers("mean", mean), b = numbers("variance", variance);
    numbers("upper", upper), numbers("mean_degrees", of_mean), numbers("variance_degrees", of_variance);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < m; j++)
            t[j] = (2.0 * designs[i * m + j] - lower[j] - upper[j]) / (upper[j] - lower[j]);
        double spread = series(variance, of_variance, 0, m, t, b);
        printf("%.12g %.12g\n", series(mean, of_mean, 0, m, t, a), sqrt(spread > 0.0 ? spread : 0.0));
    }
    return 0;
}
