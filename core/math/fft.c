// FFTW_ESTIMATE never times anything, and fftw_malloc always aligns alike: so the algorithm chosen,
// and with it every bit of a transform, depends on the size and the machine alone.
#include "core/math/fft.h"

#include <fftw3.h>
#include <stdlib.h>

enum { KEPT_SIZE = 1 << 17 };

struct Fourier {
    size_t size;
    FourierDirection direction;
    double *real;
    fftw_complex *complex;
    fftw_plan plan;
};

void fourier_start(void) {
    fftw_make_planner_thread_safe();
}

Fourier *fourier_new(size_t size, FourierDirection direction) {
    if (size == 0 || size > (size_t)1 << 30)
        return NULL;
    Fourier *fourier = calloc(1, sizeof *fourier);
    if (fourier == NULL)
        return NULL;
    fourier->size = size;
    fourier->direction = direction;
    fourier->real = fftw_alloc_real(size);
    fourier->complex = fftw_alloc_complex(size / 2 + 1);
    if (fourier->real != NULL && fourier->complex != NULL)
        fourier->plan =
            direction == FOURIER_FORWARD
                ? fftw_plan_dft_r2c_1d((int)size, fourier->real, fourier->complex, FFTW_ESTIMATE)
                : fftw_plan_dft_c2r_1d((int)size, fourier->complex, fourier->real, FFTW_ESTIMATE);
    if (fourier->plan == NULL) {
        fourier_free(fourier);
        return NULL;
    }
    return fourier;
}

void fourier_free(Fourier *fourier) {
    if (fourier == NULL)
        return;
    if (fourier->plan != NULL)
        fftw_destroy_plan(fourier->plan);
    fftw_free(fourier->complex);
    fftw_free(fourier->real);
    free(fourier);
}

double *fourier_real(Fourier *fourier) {
    return fourier->real;
}

double *fourier_complex(Fourier *fourier) {
    return &fourier->complex[0][0];
}

void fourier_run(Fourier *fourier) {
    fftw_execute(fourier->plan);
}

Fourier *fourier_take(FourierStock *stock, size_t size, FourierDirection direction) {
    for (size_t i = 0; stock != NULL && i < FOURIER_KEPT; i++) {
        Fourier *kept = stock->at[i];
        if (kept != NULL && kept->size == size && kept->direction == direction) {
            stock->at[i] = NULL;
            return kept;
        }
    }
    return fourier_new(size, direction);
}

void fourier_put(FourierStock *stock, Fourier *fourier) {
    if (stock == NULL || fourier == NULL || fourier->size > KEPT_SIZE) {
        fourier_free(fourier);
        return;
    }
    // The others move up by one into the first free place; without one the oldest goes.
    Fourier *moved = fourier;
    for (size_t i = 0; i < FOURIER_KEPT && moved != NULL; i++) {
        Fourier *next = stock->at[i];
        stock->at[i] = moved;
        moved = next;
    }
    fourier_free(moved);
}

void fourier_stock_clear(FourierStock *stock) {
    for (size_t i = 0; i < FOURIER_KEPT; i++) {
        fourier_free(stock->at[i]);
        stock->at[i] = NULL;
    }
}
