// A picture opens in its own size at a click: on a phone its text is too small.
document.addEventListener("DOMContentLoaded", () => {
  for (const picture of document.querySelectorAll(".bd-article img")) {
    picture.title = "Click to enlarge";
    picture.addEventListener("click", () => window.open(picture.src));
  }
});
