(()=>{
const tip=document.getElementById('tip'),known=new WeakMap();
const read=path=>{
  if(!known.has(path)){
    const cases=path.dataset.cases.split(' '),xy=[];
    for(const m of path.getAttribute('d').matchAll(/M(-?[\d.]+) (-?[\d.]+)/g))xy.push(+m[1],+m[2]);
    known.set(path,{cases,xy});
  }
  return known.get(path);
};
const value=(axis,place)=>{
  const[a,b,kind]=axis.split(' '),low=+a,high=+b;
  const v=kind==='log'?low*Math.pow(high/low,place):low+(high-low)*place;
  if(kind==='probit'){const t=1/(1+.2316419*Math.abs(v)),q=Math.exp(-v*v/2)*t*(.31938153+t*(-.356563782+t*(1.781477937+t*(-1.821255978+t*1.330274429))))/2.5066282746;return(100*(v<0?q:1-q)).toPrecision(3);}
  return v.toPrecision(4);
};
for(const panel of document.querySelectorAll('svg.tvse g.panel')){
  const paths=[...panel.querySelectorAll('path[data-cases]')];
  if(!paths.length)continue;
  const svg=panel.ownerSVGElement,[left,top,width,height]=panel.dataset.frame.split(' ').map(Number);
  svg.addEventListener('pointermove',event=>{
    const p=new DOMPoint(event.clientX,event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    if(p.x<left-5||p.x>left+width+5||p.y<top-5||p.y>top+height+5){if(tip.dataset.of===panel.dataset.frame)tip.style.display='none';return;}
    let best=64,found=null;
    for(const path of paths){const{cases,xy}=read(path);for(let i=0;i<cases.length;i++){const dx=xy[2*i]-p.x,dy=xy[2*i+1]-p.y,d=dx*dx+dy*dy;if(d<=best){best=d;found=[path,cases[i],xy[2*i],xy[2*i+1]];}}}
    tip.dataset.of=panel.dataset.frame;
    if(!found){tip.style.display='none';return;}
    const[path,number,x,y]=found;
    tip.textContent=`case ${number}, ${path.dataset.name}\n${panel.dataset.xLabel}: ${value(panel.dataset.x,(x-left)/width)}\n${panel.dataset.yLabel}: ${value(panel.dataset.y,1-(y-top)/height)}`;
    tip.style.whiteSpace='pre-line';tip.style.display='block';
    tip.style.left=Math.min(event.clientX+14,innerWidth-tip.offsetWidth-8)+'px';tip.style.top=Math.min(event.clientY+14,innerHeight-tip.offsetHeight-8)+'px';
  });
  svg.addEventListener('pointerleave',()=>tip.style.display='none');
}
const still=matchMedia('(prefers-reduced-motion:reduce)');
const moves=()=>{for(const svg of document.querySelectorAll('svg.tvse'))if(svg.querySelector('animate')){still.matches?svg.pauseAnimations():svg.unpauseAnimations();}};
still.addEventListener('change',moves);moves();
})();
