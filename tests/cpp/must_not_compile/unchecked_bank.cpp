// error: palpate::Bank: its estimators must be Checked
#include <palpate/bank.hpp>
#include <palpate/embedded.hpp>
palpate::Bank<palpate::embedded::PaperRls<float>, 4> bank;
