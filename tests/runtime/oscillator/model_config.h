#define MODEL_IDENTIFIER oscillator
#define MODEL_GUID "{oscillator}"
#define N_X 2
#define N_U 1
#define N_P 2
#define N_D 0
#define N_W 2
#define N_Y 2
#define N_G 0
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
